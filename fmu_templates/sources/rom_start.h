/* The state whose sensors best show given displacements and velocities. */
#ifndef ROM_START_H
#define ROM_START_H

#include "rom_kernel.h"

/* Writes to z the minimum of sum_i ((x_i(z) - target_i) / size_i)^2 nearest to rest, target in m and m/s (N_SENSOR_ROW
   values). Returns the root of that sum over the root of sum_i (target_i / size_i)^2, 0 for a target of zeros. */
double rom_find_start(const double target[], rom_workspace *w, rom_complex z[]);

#endif
