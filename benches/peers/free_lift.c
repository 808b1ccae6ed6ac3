/* free_lift.h as a shared library, for the peers that are driven from Python. */
#include "free_lift.h"

void lift_set(free_lift *k, double load_kg, double temperature_degc) { free_lift_set(k, load_kg, temperature_degc); }
void lift_at_rest(const free_lift *k, double *y) { free_lift_at_rest(k, y); }
void lift_rates(const free_lift *k, double u, const double *y, double *dy) { free_lift_rates(k, u, y, dy); }
void lift_jacobian(const free_lift *k, const double *y, double *jac) { free_lift_jacobian(k, y, jac); }

/* For solvers with one absolute tolerance: states in units of `scale`, the command read by time.
 * data: tick [s], ticks, the eight numbers of free_lift, scale[9], command[ticks]. */
void lift_rates_scaled(double t, const double *u, double *du, const double *data)
{
    const double *scale = data + 10, *command = data + 19;
    const long ticks = (long)data[1], tick = (long)(t / data[0]);
    double y[STATES];
    free_lift k;
    memcpy(&k, data + 2, sizeof k);
    for (int i = 0; i < STATES; i++) y[i] = u[i] * scale[i];
    free_lift_rates(&k, command[tick < 0 ? 0 : tick >= ticks ? ticks - 1 : tick], y, du);
    for (int i = 0; i < STATES; i++) du[i] /= scale[i];
}
