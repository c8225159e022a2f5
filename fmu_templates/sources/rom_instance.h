/* One instance: its memory (all that a saved state holds), its work arrays and its callbacks. */
#ifndef ROM_INSTANCE_H
#define ROM_INSTANCE_H

#include <stdint.h>

#include "rom_etdrk4.h"
#include "rom_log.h"
#include "rom_start.h"

#define N_INPUT_ALL (N_INPUT + N_BASE_MOTION) /* loads, then the motion of the base */
#define N_INPUT_STORED ROM_AT_LEAST_ONE(N_INPUT_ALL)

/* Modes of the FMI 2.0 state machine, as bits so that each call can name the modes it is allowed in. */
enum {
    MODE_INSTANTIATED = 1 << 0,
    MODE_INITIALIZATION = 1 << 1,
    MODE_STEP_COMPLETE = 1 << 2,
    MODE_EVENT = 1 << 3,
    MODE_CONTINUOUS = 1 << 4,
    MODE_TERMINATED = 1 << 5,
    MODE_ERROR = 1 << 6,
    MODE_WITHIN_STEP = 1 << 7, /* the importer is asked for inputs and may do nothing else; never in a saved state */
    MODE_READABLE = MODE_INITIALIZATION | MODE_STEP_COMPLETE | MODE_EVENT | MODE_CONTINUOUS | MODE_TERMINATED | MODE_ERROR,
    MODE_WRITABLE = MODE_INSTANTIATED | MODE_INITIALIZATION | MODE_STEP_COMPLETE | MODE_EVENT | MODE_CONTINUOUS,
    MODE_ANY = MODE_INSTANTIATED | MODE_READABLE
};

/* Value references of the Real variables: contiguous blocks in this order. */
enum {
    VR_STATE = 0,
    VR_RATE = VR_STATE + N_REDUCED,
    VR_INPUT = VR_RATE + N_REDUCED,
    VR_SENSOR = VR_INPUT + N_INPUT_ALL,
    VR_ABSOLUTE = VR_SENSOR + N_SENSOR_ROW,
    VR_AMPLITUDE = VR_ABSOLUTE + N_ABSOLUTE,
    VR_PHASE = VR_AMPLITUDE + N_MODE,
    VR_TRUST_RATIO = VR_PHASE + N_MODE,
    VR_INPUT_GAIN,
    VR_TRUST_RADIUS,
    VR_HARD_LIMIT,
    VR_MAX_INTERNAL_STEP,
    VR_START,
    VR_START_MISFIT = VR_START + N_START,
    VR_FREQUENCY = VR_START_MISFIT + START_FROM_SENSORS,
    VR_DAMPING = VR_FREQUENCY + N_MODE,
    VR_REAL_END = VR_DAMPING + N_MODE
};

/* Value references of the Boolean variables. */
enum { VR_INSIDE_TRUST_REGION, VR_WARN_ON_CROSSING, VR_BOOLEAN_END };

/* Everything a saved state holds, as doubles only; modes and flags are small integers and exact. */
typedef struct {
    double kind, mode;
    double time, stop_time_defined, stop_time;
    rom_complex z[N_MODE];
    double input[N_INPUT_STORED], input_derivative[N_INPUT_STORED]; /* at the present time, before the gain */
    double input_gain, trust_radius, hard_limit, max_internal_step, warn_on_crossing;
    double start[ROM_AT_LEAST_ONE(N_START)], start_misfit; /* displacements and velocities to start from */
    double inside;
} rom_memory;

#define N_MEMORY (sizeof(rom_memory) / sizeof(double))

typedef struct rom_snapshot {
    rom_memory memory;
    struct rom_snapshot *next;
} rom_snapshot;

/* What has been computed for the present memory; each is computed when it is first asked for. */
enum {
    KNOWN_RATE = 1 << 0,
    KNOWN_CHART = 1 << 1,
    KNOWN_DISPLACEMENT = 1 << 2,
    KNOWN_VELOCITY = 1 << 3,
    KNOWN_AMPLITUDE = 1 << 4
};

/* Lets the importer set the inputs at a time within a step. */
typedef void (*rom_input_request)(void *importer, double time);

typedef struct {
    rom_memory memory;
    rom_etdrk4 integrator;
    rom_workspace workspace;
    rom_complex rate[N_MODE];
    rom_output output;
    unsigned known;
    rom_snapshot *snapshots; /* every live handle given out by fmi2GetFMUstate */
    rom_logger logger;
    unsigned initial_categories;
    rom_input_request request_inputs; /* NULL: inputs are linear within a step */
    void *importer;
} rom_instance;

rom_memory rom_initial_memory(fmi2Type kind);

/* True if the instance exists and `function` may be called in its mode; a refusal is logged. */
int rom_permits(const rom_instance *s, int modes, const char *function);

/* Logs why a call was refused; nothing has been changed. */
fmi2Status rom_refuse(const rom_instance *s, const char *function, const char *reason);

/* Logs why a computation failed and enters the error mode; the state is the last good one. */
fmi2Status rom_fail(rom_instance *s, const char *function, const char *reason);

/* Forgets all computed values, after a change of the state. */
void rom_invalidate(rom_instance *s);

void rom_update_rate(rom_instance *s);

/* Logs a crossing of the trust radius by the present ratio; fmi2Warning on leaving it, if wanted. */
fmi2Status rom_check_trust(rom_instance *s, double ratio);

int rom_beyond_hard_limit(const rom_instance *s, double ratio);

/* With START_FROM_SENSORS, puts the state where the sensors best show the start values; does nothing otherwise. */
void rom_update_start(rom_instance *s);

/* Real output vr of `out`, values or their change; the absolute ones add that of the base, from all inputs after the gain. */
double rom_output_part(const rom_output *out, const double u[], fmi2ValueReference vr);

double rom_get_real(rom_instance *s, fmi2ValueReference vr);
int rom_settable_real(const rom_instance *s, fmi2ValueReference vr, double value);
void rom_set_real(rom_instance *s, fmi2ValueReference vr, double value);
void rom_free_snapshots(rom_instance *s);

/* True if vr is one of the n references from `first` on; n = 0 is fine. */
static inline int rom_in_block(fmi2ValueReference vr, fmi2ValueReference first, fmi2ValueReference n)
{
    return vr >= first && vr - first < n;
}

#endif
