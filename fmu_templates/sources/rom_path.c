#include "rom_path.h"

#include <string.h>

/* 0 to 15, or -1 */
static int hexadecimal(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    const int letter = c | 32;
    return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : -1;
}

static int is_drive(const char *text)
{
    const int letter = text[0] | 32;
    return letter >= 'a' && letter <= 'z' && (text[1] == ':' || text[1] == '|');
}

/* Length of "file:" at the start of a text, in any case; 0 if there is none. */
static size_t scheme_length(const char *text)
{
    static const char scheme[] = "file:";
    for (size_t k = 0; k < sizeof scheme - 1; ++k)
        if (text[k] == '\0' || (text[k] != ':' ? (char)(text[k] | 32) : ':') != scheme[k])
            return 0;
    return sizeof scheme - 1;
}

/* What follows the scheme without an empty or local host; another host stays as "//host/...", a network share. */
static const char *without_host(const char *text)
{
    if (strncmp(text, "//", 2) != 0)
        return text;
    if (strncmp(text + 2, "localhost/", 10) == 0)
        return text + 11;
    return text[2] == '/' || is_drive(text + 2) ? text + 2 : text;
}

/* Behind the prefix \\?\ Windows takes no other separator. */
static void use_backslashes(char path[])
{
    for (char *c = path; *c != '\0'; ++c)
        if (*c == '/')
            *c = '\\';
}

int rom_resource_path(const char *location, const char *file, int windows, char path[], size_t size)
{
    if (location == NULL || location[0] == '\0')
        return 0;
    const size_t scheme = scheme_length(location), n_file = strlen(file);
    const char *c = scheme > 0 ? without_host(location + scheme) : location;
    size_t n = 0;
    if (scheme > 0 && windows && c[0] == '/' && is_drive(c + 1))
        ++c;
    for (; *c != '\0'; ++c) {
        if (n + n_file + 2 >= size)
            return 0;
        path[n] = *c;
        if (scheme > 0 && *c == '%' && hexadecimal(c[1]) >= 0 && hexadecimal(c[2]) >= 0) {
            path[n] = (char)(16 * hexadecimal(c[1]) + hexadecimal(c[2]));
            c += 2;
        }
        if (path[n++] == '\0')
            return 0;
    }
    if (scheme > 0 && windows && is_drive(path))
        path[1] = ':'; /* C| is an old form of C: */
    if (n == 0)
        return 0;
    if (path[n - 1] != '/' && !(windows && path[n - 1] == '\\'))
        path[n++] = '/';
    memcpy(path + n, file, n_file + 1);
    if (windows && strncmp(path, "\\\\?\\", 4) == 0)
        use_backslashes(path);
    return 1;
}
