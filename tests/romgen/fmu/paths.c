/* Prints the path of the file "f" under each location given, by the rules of Windows. */
#include <stdio.h>

#include "rom_path.h"

int main(int argc, char **argv)
{
    char path[64];
    for (int k = 1; k < argc; ++k)
        puts(rom_resource_path(argv[k], "f", 1, path, sizeof path) ? path : "none");
    return 0;
}
