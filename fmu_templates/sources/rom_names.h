/* Internal names carry the model identifier, so that several of these units link into one program. */
#ifndef ROM_NAMES_H
#define ROM_NAMES_H

#include "model_sizes.h"

#define ROM_PASTE_EXPANDED(model, name) model##_##name
#define ROM_PASTE(model, name) ROM_PASTE_EXPANDED(model, name)
#define ROM_NAME(name) ROM_PASTE(MODEL_IDENTIFIER, name)

#define rom_nonlinear_rate ROM_NAME(rom_nonlinear_rate)
#define rom_rate ROM_NAME(rom_rate)
#define rom_rate_tangent ROM_NAME(rom_rate_tangent)
#define rom_chart ROM_NAME(rom_chart)
#define rom_sensors ROM_NAME(rom_sensors)
#define rom_amplitudes ROM_NAME(rom_amplitudes)
#define rom_outputs_tangent ROM_NAME(rom_outputs_tangent)
#define rom_trust_ratio ROM_NAME(rom_trust_ratio)
#define rom_eigenvalue ROM_NAME(rom_eigenvalue)
#define rom_trained_amplitude ROM_NAME(rom_trained_amplitude)
#define rom_base_share ROM_NAME(rom_base_share)
#define rom_sensor_size ROM_NAME(rom_sensor_size)
#define rom_rows ROM_NAME(rom_rows)
#define rom_has_avx ROM_NAME(rom_has_avx)
#define rom_find_start ROM_NAME(rom_find_start)
#define rom_update_start ROM_NAME(rom_update_start)
#define rom_output_part ROM_NAME(rom_output_part)
#define rom_fill_tables ROM_NAME(rom_fill_tables)
#define rom_resource_path ROM_NAME(rom_resource_path)
#define rom_etdrk4_prepare ROM_NAME(rom_etdrk4_prepare)
#define rom_etdrk4_step ROM_NAME(rom_etdrk4_step)
#define rom_log ROM_NAME(rom_log)
#define rom_log_value ROM_NAME(rom_log_value)
#define rom_utf8_length ROM_NAME(rom_utf8_length)
#define rom_category_mask ROM_NAME(rom_category_mask)
#define rom_refuse ROM_NAME(rom_refuse)
#define rom_fail ROM_NAME(rom_fail)
#define rom_permits ROM_NAME(rom_permits)
#define rom_initial_memory ROM_NAME(rom_initial_memory)
#define rom_invalidate ROM_NAME(rom_invalidate)
#define rom_update_rate ROM_NAME(rom_update_rate)
#define rom_check_trust ROM_NAME(rom_check_trust)
#define rom_beyond_hard_limit ROM_NAME(rom_beyond_hard_limit)
#define rom_get_real ROM_NAME(rom_get_real)
#define rom_settable_real ROM_NAME(rom_settable_real)
#define rom_set_real ROM_NAME(rom_set_real)
#define rom_free_snapshots ROM_NAME(rom_free_snapshots)

#endif
