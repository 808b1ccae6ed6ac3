/* CVODE (SUNDIALS 6 or 7) on one lift of free_lift.h: BDF, dense, the command held over ticks. */
#ifndef CVODE_LIFT_H
#define CVODE_LIFT_H

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <stdint.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include "free_lift.h"

#ifndef SUN_COMM_NULL
#define SUN_COMM_NULL NULL /* SUNDIALS 6 */
#endif

typedef struct {
    double rtol, atol; /* atol: times the scale of each state */
    int order;         /* greatest */
    int restart;       /* 0: never; the command jumps in i'' only, so the history stays valid; 1: at each tick */
    int stop;          /* 1: no step passes a tick */
    int jac;           /* 1: analytic, 0: difference quotients */
    int setup, jacage; /* steps between LU factorisations, and between Jacobians */
    double nls;        /* nonlinear convergence coefficient */
    double dgamma;     /* change of step that asks for a factorisation */
    int bottom;        /* 1: the stroke ends at its lower end; 0: it goes on */
    long steps;        /* most of them between two ticks */
    double scale[STATES];
} cvode_settings;

typedef struct {
    long steps, rates, factorisations, jacobians;
} work;

typedef struct {
    free_lift k;
    const double *command; /* [A], one a tick */
    int64_t ticks;
    double tick, u;
    int by_time, on_bottom;
} lowering;

typedef struct {
    cvode_settings settings;
    SUNContext context;
    N_Vector y, abstol;
    SUNMatrix matrix;
    SUNLinearSolver linear;
    void *cv;
    work total;
    lowering at;
} cvode_lift;

static int cvode_rates(sunrealtype t, N_Vector y, N_Vector dy, void *data)
{
    lowering *l = data;
    double u = l->u, *d = N_VGetArrayPointer(dy);
    if (l->by_time) {
        const int64_t n = (int64_t)(t / l->tick);
        u = l->command[n < 0 ? 0 : n >= l->ticks ? l->ticks - 1 : n];
    }
    free_lift_rates(&l->k, u, N_VGetArrayPointer(y), d);
    if (l->on_bottom) d[X] = fmax(d[X], 0), d[V] = fmax(d[V], 0);
    return 0;
}

static int cvode_jacobian(
    sunrealtype t, N_Vector y, N_Vector fy, SUNMatrix j, void *data, N_Vector a, N_Vector b, N_Vector c)
{
    (void)t, (void)fy, (void)a, (void)b, (void)c;
    free_lift_jacobian(&((lowering *)data)->k, N_VGetArrayPointer(y), SUNDenseMatrix_Data(j));
    return 0;
}

static int cvode_height(sunrealtype t, N_Vector y, sunrealtype *g, void *data)
{
    (void)t;
    g[0] = N_VGetArrayPointer(y)[X] - ((lowering *)data)->k.lower;
    return 0;
}

static void cvode_lift_free(cvode_lift *s)
{
    if (s->cv) CVodeFree(&s->cv);
    if (s->linear) SUNLinSolFree(s->linear);
    if (s->matrix) SUNMatDestroy(s->matrix);
    if (s->y) N_VDestroy(s->y);
    if (s->abstol) N_VDestroy(s->abstol);
    if (s->context) SUNContext_Free(&s->context);
}

/* 1 if all went well. */
static int cvode_lift_create(cvode_lift *s, const cvode_settings *settings)
{
    memset(s, 0, sizeof *s);
    s->settings = *settings;
    if (SUNContext_Create(SUN_COMM_NULL, &s->context) != 0) return 0;
    s->y = N_VNew_Serial(STATES, s->context);
    s->abstol = N_VNew_Serial(STATES, s->context);
    N_VConst(0, s->y);
    for (int i = 0; i < STATES; i++) N_VGetArrayPointer(s->abstol)[i] = settings->atol * settings->scale[i];
    s->matrix = SUNDenseMatrix(STATES, STATES, s->context);
    s->linear = SUNLinSol_Dense(s->y, s->matrix, s->context);
    s->cv = CVodeCreate(CV_BDF, s->context);
    int bad = CVodeInit(s->cv, cvode_rates, 0, s->y) || CVodeSVtolerances(s->cv, settings->rtol, s->abstol);
    bad |= CVodeSetUserData(s->cv, &s->at) || CVodeSetLinearSolver(s->cv, s->linear, s->matrix);
    bad |= settings->jac && CVodeSetJacFn(s->cv, cvode_jacobian);
    if (settings->bottom) {
        int falling = -1;
        bad |= CVodeRootInit(s->cv, 1, cvode_height) || CVodeSetRootDirection(s->cv, &falling);
        CVodeSetNoInactiveRootWarn(s->cv);
    }
    CVodeSetMaxOrd(s->cv, settings->order);
    CVodeSetMaxNumSteps(s->cv, settings->steps);
    CVodeSetStabLimDet(s->cv, SUNFALSE);
    CVodeSetNonlinConvCoef(s->cv, settings->nls);
    CVodeSetLSetupFrequency(s->cv, settings->setup);
    CVodeSetJacEvalFrequency(s->cv, settings->jacage);
    CVodeSetDeltaGammaMaxLSetup(s->cv, settings->dgamma);
    return !bad;
}

static void cvode_lift_count(cvode_lift *s)
{
    long steps, rates, factorisations, jacobians;
    CVodeGetNumSteps(s->cv, &steps);
    CVodeGetNumRhsEvals(s->cv, &rates);
    CVodeGetNumLinSolvSetups(s->cv, &factorisations);
    CVodeGetNumJacEvals(s->cv, &jacobians);
    s->total.steps += steps, s->total.rates += rates;
    s->total.factorisations += factorisations, s->total.jacobians += jacobians;
}

static void cvode_lift_again(cvode_lift *s, double t)
{
    cvode_lift_count(s);
    CVodeReInit(s->cv, t, s->y);
}

/* From rest at start_m through all ticks of the lowering `s->at`; x, v, p_A, p_B at each of ticks + 1 points.
 * 1 if all went well. */
static int cvode_lift_run(cvode_lift *s, double start_m, double *out)
{
    lowering *l = &s->at;
    double *y = N_VGetArrayPointer(s->y);
    free_lift_at_rest(&l->k, start_m, y);
    l->by_time = !s->settings.stop, l->on_bottom = 0, l->u = l->command[0];
    CVodeReInit(s->cv, 0, s->y);
    for (int64_t tick = 0; tick <= l->ticks; tick++, out += 4) {
        out[0] = y[X], out[1] = y[V], out[2] = y[PA], out[3] = y[PB];
        if (tick == l->ticks) break;
        l->u = l->command[tick];
        const double end = (double)(tick + 1) * l->tick;
        double t = (double)tick * l->tick;
        if (s->settings.restart && tick) cvode_lift_again(s, t);
        if (s->settings.stop) CVodeSetStopTime(s->cv, end);
        int status;
        while ((status = CVode(s->cv, end, s->y, &t, CV_NORMAL)) == CV_ROOT_RETURN) {
            y[X] = l->k.lower, y[V] = 0, l->on_bottom = 1;
            cvode_lift_again(s, t);
            if (s->settings.stop) CVodeSetStopTime(s->cv, end);
        }
        if (status < 0) return 0;
    }
    cvode_lift_count(s);
    return 1;
}

#endif
