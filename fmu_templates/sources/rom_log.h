/* Messages leave through the importer's callback: one finished string, percent signs doubled, no locale, no printf. */
#ifndef ROM_LOG_H
#define ROM_LOG_H

#include "rom_names.h" /* before the standard's header: it may hold the prefix of its functions */

#include "fmi2Functions.h"

enum {
    LOG_WARNING = 1 << 0,
    LOG_DISCARD = 1 << 1,
    LOG_ERROR = 1 << 2,
    LOG_FATAL = 1 << 3,
    LOG_TRUST_REGION = 1 << 4,
    LOG_ALL = 1 << 5,
    LOG_PROBLEMS = LOG_WARNING | LOG_DISCARD | LOG_ERROR | LOG_FATAL | LOG_TRUST_REGION,
    LOG_EVERYTHING = LOG_PROBLEMS | LOG_ALL
};

typedef struct {
    fmi2CallbackLogger callback;
    fmi2ComponentEnvironment environment;
    char instance_name[128];
    unsigned categories; /* categories that are let through */
} rom_logger;

/* Bit of a category by its name in modelDescription.xml, 0 if there is none. */
unsigned rom_category_mask(const char *name);

/* Bytes of the character at `text` (UTF-8, RFC 3629), 0 where there is none. */
size_t rom_utf8_length(const char *text);

void rom_log(const rom_logger *logger, fmi2Status status, unsigned category, const char *subject, const char *text);

/* As rom_log, followed by " <value>" with seven digits and " <unit>". */
void rom_log_value(const rom_logger *logger, fmi2Status status, unsigned category, const char *text, double value,
                   const char *unit);

#endif
