/* Peer: CVODE (SUNDIALS) in C on the free lift. cvode LOWERINGS TRAJECTORIES [name=value ...]
 *
 * rtol, atol (times the scale of each state), order (greatest), restart (0: never; the command jumps in i''
 * only, so the history stays valid; 1: at each tick), stop (1: no step passes a tick), jac (1: analytic,
 * 0: difference quotients), nls (nonlinear convergence coefficient), setup (steps between LU factorisations),
 * jacage (steps between Jacobians), dgamma (change of step that asks for a factorisation). */
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include "free_lift.h"
#include "lowerings.h"

#ifndef SUN_COMM_NULL
#define SUN_COMM_NULL NULL /* SUNDIALS 6 */
#endif

typedef struct {
    free_lift k;
    const double *command;
    double tick, u;
    int64_t ticks;
    int by_time;
} lowering;

static int rates(sunrealtype t, N_Vector y, N_Vector dy, void *data)
{
    lowering *l = data;
    double u = l->u;
    if (l->by_time) {
        const int64_t n = (int64_t)(t / l->tick);
        u = l->command[n < 0 ? 0 : n >= l->ticks ? l->ticks - 1 : n];
    }
    free_lift_rates(&l->k, u, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
    return 0;
}

static int jacobian(sunrealtype t, N_Vector y, N_Vector fy, SUNMatrix j, void *data, N_Vector a, N_Vector b, N_Vector c)
{
    (void)t, (void)fy, (void)a, (void)b, (void)c;
    free_lift_jacobian(&((lowering *)data)->k, N_VGetArrayPointer(y), SUNDenseMatrix_Data(j));
    return 0;
}

typedef struct {
    long steps, rates, factorisations, jacobians;
} work;

static void add(work *total, void *cv)
{
    long steps, rates, factorisations, jacobians;
    CVodeGetNumSteps(cv, &steps);
    CVodeGetNumRhsEvals(cv, &rates);
    CVodeGetNumLinSolvSetups(cv, &factorisations);
    CVodeGetNumJacEvals(cv, &jacobians);
    total->steps += steps, total->rates += rates;
    total->factorisations += factorisations, total->jacobians += jacobians;
}

int main(int argc, char **argv)
{
    need(argc > 2, "usage: cvode LOWERINGS TRAJECTORIES [name=value ...]");
    lowerings l = lowerings_read(argv[1]);
    const double rtol = option(argc, argv, "rtol", 1e-6), atol = option(argc, argv, "atol", rtol);
    const int restart = (int)option(argc, argv, "restart", 0), stop = (int)option(argc, argv, "stop", 1);
    const int setup = (int)option(argc, argv, "setup", 20), jacage = (int)option(argc, argv, "jacage", 51);
    const double nls = option(argc, argv, "nls", 0.1), dgamma = option(argc, argv, "dgamma", 0.3);
    const int order = (int)option(argc, argv, "order", 5), analytic = (int)option(argc, argv, "jac", 1);
    /* the size of each state: A, A/s, A, m, m/s, m, Pa, Pa, m^2 */
    const double scale[STATES] = {
        option(argc, argv, "si", 1),    option(argc, argv, "sdi", 10),   option(argc, argv, "szv", 0.04),
        option(argc, argv, "sx", 1),    option(argc, argv, "sv", 0.5),   option(argc, argv, "sz", 0.5),
        option(argc, argv, "spa", 1e7), option(argc, argv, "spb", 1e7),  option(argc, argv, "sac", 2e-5),
    };
    SUNContext context;
    need(SUNContext_Create(SUN_COMM_NULL, &context) == 0, "context");
    N_Vector y = N_VNew_Serial(STATES, context), abstol = N_VNew_Serial(STATES, context);
    for (int i = 0; i < STATES; i++) N_VGetArrayPointer(abstol)[i] = atol * scale[i];
    lowering now_at = {.tick = l.tick, .ticks = l.ticks, .by_time = !stop};
    SUNMatrix a = SUNDenseMatrix(STATES, STATES, context);
    SUNLinearSolver solver = SUNLinSol_Dense(y, a, context);
    void *cv = CVodeCreate(CV_BDF, context);
    need(CVodeInit(cv, rates, 0, y) == 0 && CVodeSVtolerances(cv, rtol, abstol) == 0, "init");
    need(CVodeSetUserData(cv, &now_at) == 0 && CVodeSetLinearSolver(cv, solver, a) == 0, "solver");
    need(!analytic || CVodeSetJacFn(cv, jacobian) == 0, "jacobian");
    CVodeSetMaxOrd(cv, order);
    CVodeSetMaxNumSteps(cv, 10000000);
    CVodeSetStabLimDet(cv, SUNFALSE);
    CVodeSetNonlinConvCoef(cv, nls);
    CVodeSetLSetupFrequency(cv, setup);
    CVodeSetJacEvalFrequency(cv, jacage);
    CVodeSetDeltaGammaMaxLSetup(cv, dgamma);

    work total = {0};
    const double begin = now();
    for (int64_t n = 0; n < l.n; n++) {
        const double *row = l.rows + n * (l.ticks + 2);
        free_lift_set(&now_at.k, row[0], row[1]);
        now_at.command = row + 2;
        free_lift_at_rest(&now_at.k, N_VGetArrayPointer(y));
        now_at.u = row[2];
        CVodeReInit(cv, 0, y);
        for (int64_t tick = 0; tick <= l.ticks; tick++) {
            const double *s = N_VGetArrayPointer(y);
            double *out = point(&l, n, tick), t;
            out[0] = s[X], out[1] = s[V], out[2] = s[PA], out[3] = s[PB];
            if (tick == l.ticks) break;
            now_at.u = now_at.command[tick];
            const double end = (double)(tick + 1) * l.tick;
            if (restart && tick) {
                add(&total, cv);
                CVodeReInit(cv, (double)tick * l.tick, y);
            }
            if (stop) CVodeSetStopTime(cv, end);
            need(CVode(cv, end, y, &t, CV_NORMAL) >= 0, "CVode");
        }
        add(&total, cv);
    }
    const double seconds = now() - begin;
    trajectories_write(&l, seconds, argv[2]);
    printf("steps %ld rhs %ld factorisations %ld jacobians %ld\n", total.steps / (long)l.n,
           total.rates / (long)l.n, total.factorisations / (long)l.n, total.jacobians / (long)l.n);
    return 0;
}
