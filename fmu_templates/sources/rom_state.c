/* Saving, restoring and serialising the memory of an instance.

   A serialised state is a sequence of 64-bit little-endian words: magic, layout version, model hash, number of
   doubles, FNV-1a hash of the doubles, then the doubles of rom_memory (IEEE 754). It holds no pointer. */
#include <stdlib.h>
#include <string.h>

#include "rom_instance.h"

#define WORD 8
#define N_HEADER 5
#define SERIALISED_SIZE (WORD * (N_HEADER + N_MEMORY))

static const uint64_t magic = UINT64_C(0x314e45474d4f52); /* the bytes "ROMGEN1" */
static const uint64_t layout_version = 2;

static void write_word(unsigned char *bytes, uint64_t word)
{
    for (int k = 0; k < WORD; ++k)
        bytes[k] = (unsigned char)(word >> (8 * k) & 0xff);
}

static uint64_t read_word(const unsigned char *bytes)
{
    uint64_t word = 0;
    for (int k = 0; k < WORD; ++k)
        word |= (uint64_t)bytes[k] << (8 * k);
    return word;
}

static uint64_t fnv1a(const unsigned char *bytes, size_t n)
{
    uint64_t hash = UINT64_C(14695981039346656037);
    for (size_t k = 0; k < n; ++k)
        hash = (hash ^ bytes[k]) * UINT64_C(1099511628211);
    return hash;
}

/* The live snapshot behind a handle, or NULL: no unknown pointer is ever dereferenced. */
static rom_snapshot *find_snapshot(const rom_instance *s, fmi2FMUstate handle)
{
    for (rom_snapshot *k = s->snapshots; k != NULL; k = k->next)
        if (k == handle)
            return k;
    return NULL;
}

static rom_snapshot *new_snapshot(rom_instance *s)
{
    rom_snapshot *snapshot = calloc(1, sizeof *snapshot);
    if (snapshot != NULL) {
        snapshot->next = s->snapshots;
        s->snapshots = snapshot;
    }
    return snapshot;
}

void rom_free_snapshots(rom_instance *s)
{
    while (s->snapshots != NULL) {
        rom_snapshot *next = s->snapshots->next;
        free(s->snapshots);
        s->snapshots = next;
    }
}

/* The snapshot a caller wants written: the one it names, or a new one for NULL. */
static fmi2Status target_snapshot(rom_instance *s, fmi2FMUstate *handle, const char *function, rom_snapshot **target)
{
    if (handle == NULL)
        return rom_refuse(s, function, "the address of the state handle is NULL");
    *target = *handle == NULL ? new_snapshot(s) : find_snapshot(s, *handle);
    if (*target == NULL)
        return rom_refuse(s, function, "the state handle is unknown to this instance, or memory is exhausted");
    *handle = *target;
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *handle)
{
    rom_instance *s = c;
    rom_snapshot *target = NULL;
    if (!rom_permits(s, MODE_ANY, "fmi2GetFMUstate") ||
        target_snapshot(s, handle, "fmi2GetFMUstate", &target) != fmi2OK)
        return fmi2Error;
    target->memory = s->memory;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate handle)
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_ANY, "fmi2SetFMUstate"))
        return fmi2Error;
    const rom_snapshot *source = find_snapshot(s, handle);
    if (source == NULL)
        return rom_refuse(s, "fmi2SetFMUstate", "the state handle is unknown to this instance");
    s->memory = source->memory;
    rom_invalidate(s);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *handle)
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_ANY, "fmi2FreeFMUstate"))
        return fmi2Error;
    if (handle == NULL || *handle == NULL)
        return fmi2OK;
    for (rom_snapshot **link = &s->snapshots; *link != NULL; link = &(*link)->next)
        if (*link == *handle) {
            rom_snapshot *dead = *link;
            *link = dead->next;
            free(dead);
            *handle = NULL;
            return fmi2OK;
        }
    return rom_refuse(s, "fmi2FreeFMUstate", "the state handle is unknown to this instance or was freed before");
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate handle, size_t *size)
{
    const rom_instance *s = c;
    if (!rom_permits(s, MODE_ANY, "fmi2SerializedFMUstateSize"))
        return fmi2Error;
    if (size == NULL || find_snapshot(s, handle) == NULL)
        return rom_refuse(s, "fmi2SerializedFMUstateSize", "the state handle is unknown to this instance");
    *size = SERIALISED_SIZE;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate handle, fmi2Byte bytes[], size_t size)
{
    const rom_instance *s = c;
    if (!rom_permits(s, MODE_ANY, "fmi2SerializeFMUstate"))
        return fmi2Error;
    const rom_snapshot *source = find_snapshot(s, handle);
    if (source == NULL || bytes == NULL || size < SERIALISED_SIZE)
        return rom_refuse(s, "fmi2SerializeFMUstate", "unknown state handle, or a buffer that is too small");
    unsigned char *out = (unsigned char *)bytes;
    for (size_t k = 0; k < N_MEMORY; ++k) {
        uint64_t word;
        memcpy(&word, (const unsigned char *)&source->memory + WORD * k, WORD);
        write_word(out + WORD * (N_HEADER + k), word);
    }
    const uint64_t header[N_HEADER] = {magic, layout_version, MODEL_HASH, N_MEMORY,
                                       fnv1a(out + WORD * N_HEADER, WORD * N_MEMORY)};
    for (size_t k = 0; k < N_HEADER; ++k)
        write_word(out + WORD * k, header[k]);
    return fmi2OK;
}

/* Why `bytes` is no state of this model in this layout, or NULL if it is one. */
static const char *why_foreign(const unsigned char *bytes, size_t size)
{
    if (bytes == NULL || size != SERIALISED_SIZE)
        return "the serialised state has another length than this model writes";
    if (read_word(bytes) != magic || read_word(bytes + WORD) != layout_version)
        return "the bytes are no serialised state, or one of another layout version";
    if (read_word(bytes + 2 * WORD) != MODEL_HASH || read_word(bytes + 3 * WORD) != N_MEMORY)
        return "the serialised state belongs to another model";
    if (read_word(bytes + 4 * WORD) != fnv1a(bytes + WORD * N_HEADER, WORD * N_MEMORY))
        return "the serialised state is damaged";
    return NULL;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *handle)
{
    rom_instance *s = c;
    rom_memory memory;
    rom_snapshot *target = NULL;
    const unsigned char *in = (const unsigned char *)bytes;
    if (!rom_permits(s, MODE_ANY, "fmi2DeSerializeFMUstate"))
        return fmi2Error;
    const char *reason = why_foreign(in, size);
    if (reason != NULL)
        return rom_refuse(s, "fmi2DeSerializeFMUstate", reason);
    for (size_t k = 0; k < N_MEMORY; ++k) {
        const uint64_t word = read_word(in + WORD * (N_HEADER + k));
        memcpy((unsigned char *)&memory + WORD * k, &word, WORD);
    }
    if (memory.kind != s->memory.kind)
        return rom_refuse(s, "fmi2DeSerializeFMUstate", "the state was saved by the other kind of instance (ME or CS)");
    if (target_snapshot(s, handle, "fmi2DeSerializeFMUstate", &target) != fmi2OK)
        return fmi2Error;
    target->memory = memory;
    return fmi2OK;
}
