/* From the resource location an importer gives to the path of a file in it. */
#ifndef ROM_PATH_H
#define ROM_PATH_H

#include <stddef.h>

#include "rom_names.h"

/* Writes the path of `file` under `location`, a file URI (RFC 8089) in UTF-8 or a plain path; plain paths are taken as
   they are. With `windows`, "/C:/x" means drive C. Returns 0 where there is no location, it is no file, or is too long. */
int rom_resource_path(const char *location, const char *file, int windows, char path[], size_t size);

#endif
