/* Peer: RADAU of Hairer and Wanner (Fortran) on the free lift. radau LOWERINGS TRAJECTORIES [name=value ...]
 *
 * rtol, atol (times the scale of each state), stages (greatest number: 3 is RADAU5, 7 varies the order up to
 * 13), stop (1: no step passes a tick, 0: one call for the whole lowering, ticks by its dense output),
 * control (1: predictive step control, 2: classical), theta (below which a Jacobian is kept). */
#include "free_lift.h"
#include "lowerings.h"

typedef struct {
    free_lift k;
    const double *command;
    double u, *out;
    const lowerings *l;
    int64_t next;
    int by_time;
} lowering;

void radau_(int *n, void *rates, double *t, double *y, double *end, double *h, double *rtol, double *atol,
            int *vectors, void *jacobian, int *analytic, int *lower, int *upper, void *mass, int *with_mass,
            int *mass_lower, int *mass_upper, void *output, int *dense, double *work, int *lwork, int *iwork,
            int *liwork, double *rpar, int *ipar, int *idid, char *message, size_t length);
double contra_(int *state, double *t, double *cont, int *length);

static void rates(int *n, double *t, double *y, double *dy, double *unused, void *data)
{
    (void)n, (void)unused;
    lowering *w = data;
    double u = w->u;
    if (w->by_time) {
        const int64_t tick = (int64_t)(*t / w->l->tick);
        u = w->command[tick < 0 ? 0 : tick >= w->l->ticks ? w->l->ticks - 1 : tick];
    }
    free_lift_rates(&w->k, u, y, dy);
}

static void jacobian(int *n, double *t, double *y, double *jac, int *rows, double *unused, void *data)
{
    (void)n, (void)t, (void)rows, (void)unused;
    free_lift_jacobian(&((lowering *)data)->k, y, jac);
}

static void output(int *step, double *before, double *t, double *y, double *cont, int *length, int *n,
                   double *unused, void *data, int *leave)
{
    (void)step, (void)before, (void)y, (void)n, (void)unused, (void)leave;
    lowering *w = data;
    static const int shown[4] = {X, V, PA, PB};
    for (; w->next <= w->l->ticks && (double)w->next * w->l->tick <= *t; w->next++) {
        double at = (double)w->next * w->l->tick;
        for (int i = 0; i < 4; i++) {
            int state = shown[i] + 1;
            w->out[w->next * 4 + i] = *step == 1 ? y[shown[i]] : contra_(&state, &at, cont, length);
        }
    }
}

int main(int argc, char **argv)
{
    need(argc > 2, "usage: radau LOWERINGS TRAJECTORIES [name=value ...]");
    lowerings l = lowerings_read(argv[1]);
    const double tolerance = option(argc, argv, "rtol", 1e-6), factor = option(argc, argv, "atol", tolerance);
    const int stages = (int)option(argc, argv, "stages", 3), stop = (int)option(argc, argv, "stop", 1);
    const int control = (int)option(argc, argv, "control", 1);
    const double theta = option(argc, argv, "theta", 0.001);
    const double scale[STATES] = {
        option(argc, argv, "si", 1),    option(argc, argv, "sdi", 10),   option(argc, argv, "szv", 0.04),
        option(argc, argv, "sx", 1),    option(argc, argv, "sv", 0.5),   option(argc, argv, "sz", 0.5),
        option(argc, argv, "spa", 1e7), option(argc, argv, "spb", 1e7),  option(argc, argv, "sac", 2e-5),
    };
    enum { LWORK = 8 * STATES * STATES + 24 * STATES + 20, LIWORK = 5 * STATES + 20 };
    int n = STATES, lower = STATES, upper = STATES, one = 1, zero = 0, lwork = LWORK, liwork = LIWORK, idid, dense = !stop;
    double rtol[STATES], atol[STATES], y[STATES], work[LWORK];
    int iwork[LIWORK];
    long steps = 0, calls = 0, factorisations = 0, jacobians = 0;
    char message[1024];
    for (int i = 0; i < STATES; i++) rtol[i] = tolerance, atol[i] = factor * scale[i];

    const double begin = now();
    for (int64_t lowered = 0; lowered < l.n; lowered++) {
        const double *row = l.rows + lowered * (l.ticks + 2);
        lowering w = {.command = row + 2, .l = &l, .out = point(&l, lowered, 0), .by_time = !stop};
        free_lift_set(&w.k, row[0], row[1]);
        free_lift_at_rest(&w.k, 0.98, y);
        double t = 0, h = 1e-5;
        for (int64_t tick = 0; tick <= l.ticks; tick++) {
            double *out = point(&l, lowered, tick), end = (double)(stop ? tick + 1 : l.ticks) * l.tick;
            if (stop || tick == l.ticks) out[0] = y[X], out[1] = y[V], out[2] = y[PA], out[3] = y[PB];
            if (tick == l.ticks) break;
            memset(work, 0, 20 * sizeof *work);
            memset(iwork, 0, 20 * sizeof *iwork);
            work[2] = theta;
            iwork[1] = 10000000, iwork[7] = control, iwork[10] = 3, iwork[11] = stages;
            w.u = w.command[tick];
            t = (double)tick * l.tick;
            if (!(h > 1e-5)) h = 1e-5;
            radau_(&n, rates, &t, y, &end, &h, rtol, atol, &one, jacobian, &one, &lower, &upper, NULL, &zero,
                   &zero, &zero, output, &dense, work, &lwork, iwork, &liwork, NULL, (int *)&w, &idid, message,
                   sizeof message);
            /* after a rejected last step it may stop a rounding error short of the end, and say -3 */
            need(idid == 1 || (idid == -3 && end - t < 1e-12), "radau");
            calls += iwork[13], jacobians += iwork[14], steps += iwork[15], factorisations += iwork[18];
            if (!stop) tick = l.ticks - 1;
        }
    }
    const double seconds = now() - begin;
    trajectories_write(&l, seconds, argv[2]);
    printf("steps %ld rhs %ld factorisations %ld jacobians %ld\n", steps / (long)l.n, calls / (long)l.n,
           factorisations / (long)l.n, jacobians / (long)l.n);
    return 0;
}
