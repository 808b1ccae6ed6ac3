/* free_lift.h as a shared library, for the peers that are driven from Python. */
#include "free_lift.h"

enum { NUMBERS = sizeof(free_lift) / sizeof(double) };

int lift_numbers(void) { return NUMBERS; }
int lift_parameter_numbers(void) { return sizeof(lift_parameters) / sizeof(double); }
void lift_set(free_lift *k, double load_kg, double temperature_degc) { free_lift_set(k, load_kg, temperature_degc); }
void lift_from(free_lift *k, const lift_parameters *p, double load_kg, double temperature_degc)
{
    free_lift_from(k, p, load_kg, temperature_degc);
}
void lift_at_rest(const free_lift *k, double start_m, double *y) { free_lift_at_rest(k, start_m, y); }
void lift_rates(const free_lift *k, double u, const double *y, double *dy) { free_lift_rates(k, u, y, dy); }
void lift_jacobian(const free_lift *k, const double *y, double *jac) { free_lift_jacobian(k, y, jac); }

/* For solvers with one absolute tolerance: states in units of `scale`, the command read by time.
 * data: tick [s], ticks, the numbers of free_lift, scale[9], command[ticks]. */
void lift_rates_scaled(double t, const double *u, double *du, const double *data)
{
    const free_lift *k = (const free_lift *)(data + 2);
    const double *scale = data + 2 + NUMBERS, *command = scale + STATES;
    const long ticks = (long)data[1], tick = (long)(t / data[0]);
    double y[STATES];
    for (int i = 0; i < STATES; i++) y[i] = u[i] * scale[i];
    free_lift_rates(k, command[tick < 0 ? 0 : tick >= ticks ? ticks - 1 : tick], y, du);
    for (int i = 0; i < STATES; i++) du[i] /= scale[i];
}
