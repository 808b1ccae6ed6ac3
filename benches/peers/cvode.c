/* Peer: CVODE (SUNDIALS) in C on the free lift. cvode LOWERINGS TRAJECTORIES [name=value ...]
 *
 * The names are those of cvode_settings in cvode_lift.h; the scale of each state is si, sdi, szv, sx, sv, sz,
 * spa, spb, sac. */
#include "cvode_lift.h"
#include "lowerings.h"

int main(int argc, char **argv)
{
    need(argc > 2, "usage: cvode LOWERINGS TRAJECTORIES [name=value ...]");
    lowerings l = lowerings_read(argv[1]);
    const double rtol = option(argc, argv, "rtol", 1e-6);
    const cvode_settings settings = {
        .rtol = rtol,
        .atol = option(argc, argv, "atol", rtol),
        .restart = (int)option(argc, argv, "restart", 0),
        .stop = (int)option(argc, argv, "stop", 1),
        .setup = (int)option(argc, argv, "setup", 20),
        .jacage = (int)option(argc, argv, "jacage", 51),
        .nls = option(argc, argv, "nls", 0.1),
        .dgamma = option(argc, argv, "dgamma", 0.3),
        .order = (int)option(argc, argv, "order", 5),
        .jac = (int)option(argc, argv, "jac", 1),
        .steps = 10000000,
        /* the size of each state: A, A/s, A, m, m/s, m, Pa, Pa, m^2 */
        .scale = {
            option(argc, argv, "si", 1),    option(argc, argv, "sdi", 10),   option(argc, argv, "szv", 0.04),
            option(argc, argv, "sx", 1),    option(argc, argv, "sv", 0.5),   option(argc, argv, "sz", 0.5),
            option(argc, argv, "spa", 1e7), option(argc, argv, "spb", 1e7),  option(argc, argv, "sac", 2e-5),
        },
    };
    cvode_lift s;
    need(cvode_lift_create(&s, &settings), "set-up");
    s.at.tick = l.tick, s.at.ticks = l.ticks;

    const double begin = now();
    for (int64_t n = 0; n < l.n; n++) {
        const double *row = l.rows + n * (l.ticks + 2);
        free_lift_set(&s.at.k, row[0], row[1]);
        s.at.command = row + 2;
        need(cvode_lift_run(&s, 0.98, point(&l, n, 0)), "CVode");
    }
    const double seconds = now() - begin;
    trajectories_write(&l, seconds, argv[2]);
    printf("steps %ld rhs %ld factorisations %ld jacobians %ld\n", s.total.steps / (long)l.n,
           s.total.rates / (long)l.n, s.total.factorisations / (long)l.n, s.total.jacobians / (long)l.n);
    cvode_lift_free(&s);
    return 0;
}
