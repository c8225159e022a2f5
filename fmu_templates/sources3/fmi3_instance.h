/* FMI 3.0 on top of the same runtime: an instance and the arrays its value references name. */
#ifndef FMI3_INSTANCE_H
#define FMI3_INSTANCE_H

#include "rom_instance.h"

#include "fmi3Functions.h"

#define ROM3_NAME(name) ROM_NAME(name)
#define rom3_block_length ROM3_NAME(rom3_block_length)
#define rom3_refuse ROM3_NAME(rom3_refuse)

/* Value references: that of the first element for Float64, then the Booleans, then time. */
enum { VR3_BOOLEAN = VR_REAL_END, VR3_TIME = VR3_BOOLEAN + VR_BOOLEAN_END };

typedef struct {
    rom_instance *s;
    fmi3LogMessageCallback log;
    fmi3IntermediateUpdateCallback update;
    fmi3InstanceEnvironment environment;
    int updating; /* within an intermediate update: no step, and the instance must stay */
} rom3_instance;

/* Number of elements of the Float64 variable vr, 0 if there is none. */
size_t rom3_block_length(fmi3ValueReference vr);

fmi3Status rom3_refuse(const rom3_instance *i, const char *function, const char *reason);

/* The statuses of both versions have the same numbers as far as this runtime uses them. */
static inline fmi3Status rom3_status(fmi2Status status)
{
    return (fmi3Status)status;
}

#endif
