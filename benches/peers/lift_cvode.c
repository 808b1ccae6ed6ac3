/* cvode_lift.h as a shared library: one lift with any parameters, as a fit simulates it. Holds no state, so that
 * threads may call it side by side. */
#include "cvode_lift.h"

int lift_parameter_numbers(void) { return sizeof(lift_parameters) / sizeof(double); }

/* x, v, p_A, p_B at ticks + 1 points; settings: rtol, restart, stop, order, nls, setup, jacage, dgamma, scale[9].
 * 1 if all went well. */
int lift_simulate(
    const lift_parameters *p, double load_kg, double temperature_degc, double start_m, double tick, int64_t ticks,
    const double *command, const double *settings, double *out)
{
    cvode_settings s = {
        .rtol = settings[0], .atol = settings[0], .restart = (int)settings[1], .stop = (int)settings[2],
        .order = (int)settings[3], .nls = settings[4], .setup = (int)settings[5], .jacage = (int)settings[6],
        .dgamma = settings[7], .jac = 1, .bottom = 1, .steps = 20000,
    };
    memcpy(s.scale, settings + 8, sizeof s.scale);
    cvode_lift lift;
    int done = cvode_lift_create(&lift, &s);
    if (done) {
        free_lift_from(&lift.at.k, p, load_kg, temperature_degc);
        lift.at.command = command, lift.at.tick = tick, lift.at.ticks = ticks;
        done = cvode_lift_run(&lift, start_m, out);
    }
    cvode_lift_free(&lift);
    return done;
}
