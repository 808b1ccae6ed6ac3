/* For Frama-C's Eva: ticks without end over every request and reading, the gains anywhere in their declared ranges,
 * or as they are where FC_OWN_GAINS is defined.
 *
 *   frama-c -eva -eva-precision 3 -warn-signed-downcast -warn-signed-overflow forklift_control.c forklift_control_eva.c
 *
 * configuration   @HASH@
 */
#include "forklift_control.h"
#include "__fc_builtin.h"

#ifndef FC_OWN_GAINS
/* A mantissa's range at the shift of the configuration. */
static fc_gain declared(int32_t lower, int32_t upper, uint8_t shift)
{
    fc_gain gain;
    gain.mantissa = (fc_word)Frama_C_interval(lower, upper);
    gain.shift = shift;
    return gain;
}
#endif

int main(void)
{
    fc_config config = fc_controller;
    fc_state state = { 0 };
    volatile int on = 1;
#ifndef FC_OWN_GAINS
@DECLARED@
#endif
    while (on != 0) {
        fc_reading reading;
        int32_t current[2] = { 0, 0 };
        const int32_t request = Frama_C_interval(INT32_MIN, INT32_MAX);
        reading.position[0] = Frama_C_interval(INT32_MIN, INT32_MAX);
        reading.position[1] = Frama_C_interval(INT32_MIN, INT32_MAX);
        reading.pressure[0] = Frama_C_interval(INT32_MIN, INT32_MAX);
        reading.pressure[1] = Frama_C_interval(INT32_MIN, INT32_MAX);
        reading.temperature = Frama_C_interval(INT32_MIN, INT32_MAX);
        fc_tick(&config, &state, request, &reading, current);
    }
    return 0;
}
