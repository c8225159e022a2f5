#include "rom_log.h"

#include "rom_kernel.h"

#include <math.h>
#include <string.h>

#define LENGTH 512

typedef struct {
    char text[LENGTH];
    size_t n;
} message;

static const struct {
    const char *name;
    unsigned bit;
} category_names[] = {
    {"logStatusWarning", LOG_WARNING}, {"logStatusDiscard", LOG_DISCARD}, {"logStatusError", LOG_ERROR},
    {"logStatusFatal", LOG_FATAL},     {"trustRegion", LOG_TRUST_REGION}, {"logAll", LOG_ALL},
};

#define N_CATEGORY (sizeof category_names / sizeof category_names[0])

unsigned rom_category_mask(const char *name)
{
    for (size_t k = 0; k < N_CATEGORY; ++k)
        if (name != NULL && strcmp(name, category_names[k].name) == 0)
            return category_names[k].bit == LOG_ALL ? (unsigned)LOG_EVERYTHING : category_names[k].bit;
    return 0;
}

static const char *category_name(unsigned bit)
{
    for (size_t k = 0; k < N_CATEGORY; ++k)
        if (category_names[k].bit == bit)
            return category_names[k].name;
    return "logAll";
}

static void put(message *m, char c)
{
    if (m->n + 3 > LENGTH)
        return;
    m->text[m->n++] = c;
    if (c == '%') /* the callback reads its message as a format */
        m->text[m->n++] = '%';
    m->text[m->n] = '\0';
}

size_t rom_utf8_length(const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    if (c[0] < 0x80)
        return c[0] != 0;
    const size_t n = c[0] >= 0xf0 ? 4 : c[0] >= 0xe0 ? 3 : 2;
    const int legal = c[0] >= 0xc2 && c[0] <= 0xf4 && !(c[0] == 0xe0 && c[1] < 0xa0) && !(c[0] == 0xed && c[1] > 0x9f) &&
                      !(c[0] == 0xf0 && c[1] < 0x90) && !(c[0] == 0xf4 && c[1] > 0x8f);
    for (size_t k = 1; legal && k < n; ++k)
        if ((c[k] & 0xc0) != 0x80)
            return 0;
    return legal ? n : 0;
}

/* Whole characters only: what is no UTF-8 becomes '?', what would break a line a blank. */
static void put_text(message *m, const char *text)
{
    while (*text != '\0') {
        const size_t n = rom_utf8_length(text);
        if (n <= 1)
            put(m, n == 0 ? '?' : (unsigned char)*text < ' ' ? ' ' : *text);
        else if (m->n + n < LENGTH) {
            memcpy(m->text + m->n, text, n);
            m->n += n;
            m->text[m->n] = '\0';
        }
        text += n == 0 ? 1 : n;
    }
}

static void put_digits(message *m, unsigned long value, int width)
{
    unsigned long unit = 1;
    for (int k = 1; k < width; ++k)
        unit *= 10;
    for (; unit > 0; unit /= 10)
        put(m, (char)('0' + (int)(value / unit % 10)));
}

/* d.dddddde[-]dd, independent of the locale */
static void put_number(message *m, double value)
{
    if (value != value) {
        put_text(m, "nan");
        return;
    }
    if (value < 0.0)
        put(m, '-');
    value = fabs(value);
    if (!rom_is_finite(value)) {
        put_text(m, "inf");
        return;
    }
    int exponent = 0;
    for (; value >= 10.0; ++exponent)
        value /= 10.0;
    for (; value > 0.0 && value < 1.0; --exponent)
        value *= 10.0;
    unsigned long digits = (unsigned long)(value * 1e6 + 0.5);
    if (digits >= 10000000UL) {
        digits /= 10;
        ++exponent;
    }
    put_digits(m, digits / 1000000UL, 1);
    put(m, '.');
    put_digits(m, digits % 1000000UL, 6);
    if (exponent != 0) {
        put_text(m, exponent < 0 ? "e-" : "e");
        const int size = exponent < 0 ? -exponent : exponent;
        put_digits(m, (unsigned long)size, size < 100 ? 2 : 3);
    }
}

static void deliver(const rom_logger *logger, fmi2Status status, unsigned category, const message *m)
{
    if (logger->callback != NULL && (logger->categories & category) != 0)
        logger->callback(logger->environment, logger->instance_name, status, category_name(category), m->text);
}

void rom_log(const rom_logger *logger, fmi2Status status, unsigned category, const char *subject, const char *text)
{
    message m = {"", 0};
    put_text(&m, subject);
    put_text(&m, ": ");
    put_text(&m, text);
    deliver(logger, status, category, &m);
}

void rom_log_value(const rom_logger *logger, fmi2Status status, unsigned category, const char *text, double value,
                   const char *unit)
{
    message m = {"", 0};
    put_text(&m, text);
    put(&m, ' ');
    put_number(&m, value);
    put(&m, ' ');
    put_text(&m, unit);
    deliver(logger, status, category, &m);
}
