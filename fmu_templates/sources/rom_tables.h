/* Where the large tables of an instance come from: the library itself, or a file among the resources of the unit. */
#ifndef ROM_TABLES_H
#define ROM_TABLES_H

#include "rom_kernel.h"

#define ROM_PATH_SIZE 1024 /* with more, Windows wants code of its C library to grow the stack */

/* Fills the tables; returns NULL, or why it cannot, with the file concerned in `path` (empty if there is none). */
const char *rom_fill_tables(const char *location, rom_tables *tables, char path[ROM_PATH_SIZE]);

#endif
