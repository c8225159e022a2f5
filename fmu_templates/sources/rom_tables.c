/* coefficients.bin is rom_tables as 64-bit little-endian words (IEEE 754) and nothing else. */
#include "rom_tables.h"

#include <string.h>

#if COEFFICIENTS_IN_FILE

#include <stdint.h>
#include <stdio.h>

#include "rom_path.h"

#define WORD 8
#define N_TABLE (sizeof(rom_tables) / WORD)

#ifdef _WIN32
#define ON_WINDOWS 1

/* Windows takes UTF-16; a byte that is no UTF-8 becomes U+FFFD, which no file is called. */
static FILE *open_to_read(const char *path)
{
    wchar_t wide[ROM_PATH_SIZE];
    size_t n = 0;
    for (const unsigned char *c = (const unsigned char *)path; *c != '\0'; ++c) {
        const int more = *c < 0x80 ? 0 : *c >= 0xf0 ? 3 : *c >= 0xe0 ? 2 : 1;
        uint32_t code = more == 0 ? *c : *c & (0x3fu >> more);
        int k = 0;
        while (k < more && (c[1] & 0xc0) == 0x80) {
            code = code << 6 | (*++c & 0x3fu);
            ++k;
        }
        if (k < more || code > 0x10ffff)
            code = 0xfffd;
        if (code >= 0x10000) {
            wide[n++] = (wchar_t)(0xd7c0 + (code >> 10));
            code = 0xdc00 | (code & 0x3ff);
        }
        wide[n++] = (wchar_t)code;
    }
    wide[n] = L'\0';
    FILE *file = _wfopen(wide, L"rb");
    return file != NULL ? file : fopen(path, "rb"); /* some importers write paths in the system's own code page */
}
#else
#define ON_WINDOWS 0

static FILE *open_to_read(const char *path)
{
    return fopen(path, "rb");
}
#endif

/* Turns little-endian words into doubles in place; returns their FNV-1a hash, word by word. */
static uint64_t decoded(rom_tables *tables)
{
    unsigned char *bytes = (unsigned char *)tables;
    uint64_t hash = UINT64_C(14695981039346656037);
    for (size_t k = 0; k < N_TABLE; ++k, bytes += WORD) {
        uint64_t word = 0;
        for (int i = WORD - 1; i >= 0; --i)
            word = word << 8 | bytes[i];
        memcpy(bytes, &word, WORD);
        hash = (hash ^ word) * UINT64_C(1099511628211);
    }
    return hash;
}

/* The file at `path` under the resource location, or under its folder "resources": some importers give the folder of the unit. */
static FILE *opened(const char *location, char path[ROM_PATH_SIZE])
{
    char below[ROM_PATH_SIZE];
    FILE *file = open_to_read(path);
    if (file == NULL && rom_resource_path(location, "resources/coefficients.bin", ON_WINDOWS, below, ROM_PATH_SIZE))
        file = open_to_read(below);
    return file;
}

const char *rom_fill_tables(const char *location, rom_tables *tables, char path[ROM_PATH_SIZE])
{
    unsigned char beyond;
    if (!rom_resource_path(location, "coefficients.bin", ON_WINDOWS, path, ROM_PATH_SIZE)) {
        path[0] = '\0';
        return "the resource location is missing, no file URI, or too long; the coefficients of the model lie there";
    }
    FILE *file = opened(location, path);
    if (file == NULL)
        return "the coefficients cannot be opened; the resource location must be the resources folder of the unpacked unit";
    const int complete = fread(tables, sizeof *tables, 1, file) == 1 && fread(&beyond, 1, 1, file) == 0;
    fclose(file);
    if (!complete || decoded(tables) != TABLE_HASH)
        return "the coefficients are damaged or belong to another export";
    return NULL;
}

#else

#include "tables.h"

const char *rom_fill_tables(const char *location, rom_tables *tables, char path[ROM_PATH_SIZE])
{
    (void)location;
    path[0] = '\0';
    memcpy(tables, embedded_table, sizeof *tables);
    return NULL;
}

#endif
