/* One lift of the thesis in plain C: right-hand side and analytic Jacobian, for the peers of the benches.
 *
 * Fri & Fahlén, LiTH-ISY-EX--17/5050--SE, 2017, chapter 3; the free lift's values of Table 5.1. States, SI units:
 * i [A], di/dt [A/s], z_valve [A], x [m], v [m/s], z [m], p_A [Pa], p_B [Pa], A_comp [m^2].
 * What does not change within a lowering is computed once, in free_lift_from. */
#ifndef FREE_LIFT_H
#define FREE_LIFT_H

#include <math.h>
#include <string.h>

enum { I, DI, ZV, X, V, Z, PA, PB, AC, STATES };

#define MOST_KNOTS 24

/* A lift's parameters as `forklift info` lists them, in its order; then the table of the valve's opening. */
typedef struct {
    double nu_0, t_0, lambda, density, g, p_tank, volume, e_volume;
    double area, v_0, m_c, stroke_lower, stroke_upper, m_moving;
    double e_max, p_max, a_1, a_2, a_3;
    double f_pr, k_brk, c_v, f_cfr, sigma_0, sigma_1, sigma_2;
    double damping, omega, f_hs, re_cr, c_d, valve_sigma_0, valve_sigma_1, a_min;
    double a_max, a_leak, a_spool, p_reg, p_set, tau, comp_c_d, comp_re_cr, theta;
    double knots, current[MOST_KNOTS], opening[MOST_KNOTS];
} lift_parameters;

static const lift_parameters THESIS_FREE = {
    .nu_0 = 4.45e-5, .t_0 = 293, .lambda = 0.0050814, .density = 860, .g = 9.82, .p_tank = 1e5,
    .volume = 2000e-9, .e_volume = 7e8, .area = M_PI * 0.0275 * 0.0275, .v_0 = 0.0055302, .m_c = 12.6,
    .stroke_lower = 0, .stroke_upper = 1.1, .m_moving = 278, .e_max = 18000e5, .p_max = 280e5,
    .a_1 = 0.15703, .a_2 = 11.841, .a_3 = 367.5, .f_pr = 113.81, .k_brk = 3.769, .c_v = 261.2,
    .f_cfr = 2.6445, .sigma_0 = 2517.2, .sigma_1 = 14342, .sigma_2 = 4137.8, .damping = 1, .omega = 34.327,
    .f_hs = 0.018723, .re_cr = 5543.9, .c_d = 0.67, .valve_sigma_0 = 0.5, .valve_sigma_1 = 0.1, .a_min = 1e-9,
    .a_max = 100e-6, .a_leak = 1e-9, .a_spool = 3.14e-4, .p_reg = 2.7e5, .p_set = 5.4e5, .tau = 0.01,
    .comp_c_d = 0.84417, .comp_re_cr = 18546, .theta = 0.63222, .knots = 8,
    .current = {0, 0.36, 0.45, 0.60, 0.80, 1.0, 1.2, 1.4},
    .opening = {0, 0, 0.13e-5, 0.66e-5, 1.55e-5, 2.6e-5, 3.7e-5, 4.4e-5},
};

typedef struct {
    double kappa, kappa_c;           /* p_cr = kappa / area, of valve and compensator [Pa m^2] */
    double weight, inertia;          /* [N], [kg] */
    double friction;                 /* F_pr + m f_cfr [N] */
    double c_flow;                   /* C_D cos(theta) / A_spool of the compensator [1/m^2] */
    double root, root_c;             /* C_D sqrt(2 / rho) of valve and compensator */
    double w2, two_d_w, s0_f, s0, s1; /* of the valve: omega^2, 2 D / omega, sigma_0 / f_hs, sigma_0, sigma_1 */
    double k_brk, c_v, sigma_0, sigma_1, sigma_2;
    double area, v_0, e_a, e_slope, e_offset, e_volume, p_tank;
    double a_min, a_max, a_leak, slope, p_set, tau, lower;
    double knots, current[MOST_KNOTS], opening[MOST_KNOTS];
} free_lift;

static inline void free_lift_from(free_lift *k, const lift_parameters *p, double load_kg, double temperature_degc)
{
    const double m = p->m_moving + load_kg;
    const double nu = p->nu_0 * exp(-p->lambda * (temperature_degc + 273.0 - p->t_0)); /* (3.1) */
    const double re = p->re_cr * nu / p->c_d, re_c = p->comp_re_cr * nu / p->comp_c_d;
    k->kappa = p->density / 2 * re * re * M_PI / 4; /* (3.8), (3.9) */
    k->kappa_c = p->density / 2 * re_c * re_c * M_PI / 4;
    k->weight = (p->m_c + 2 * m) * p->g;
    k->inertia = p->m_c + 4 * m;
    k->friction = fmax(p->f_pr + m * p->f_cfr, 1e-3);
    k->c_flow = p->comp_c_d * cos(p->theta) / p->a_spool;
    k->root = p->c_d * sqrt(2 / p->density);
    k->root_c = p->comp_c_d * sqrt(2 / p->density);
    k->w2 = p->omega * p->omega;
    k->two_d_w = 2 * p->damping / p->omega;
    k->s0_f = p->valve_sigma_0 / p->f_hs;
    k->s0 = p->valve_sigma_0, k->s1 = p->valve_sigma_1;
    k->k_brk = p->k_brk, k->c_v = p->c_v;
    k->sigma_0 = p->sigma_0, k->sigma_1 = p->sigma_1, k->sigma_2 = p->sigma_2;
    k->area = p->area, k->v_0 = p->v_0;
    k->e_a = p->a_1 * p->e_max, k->e_slope = p->a_2 / p->p_max, k->e_offset = p->a_3;
    k->e_volume = p->e_volume / p->volume;
    k->p_tank = p->p_tank;
    k->a_min = p->a_min, k->a_max = p->a_max, k->a_leak = p->a_leak;
    k->slope = (p->a_max - p->a_leak) / p->p_reg;
    k->p_set = p->p_set, k->tau = p->tau, k->lower = p->stroke_lower;
    k->knots = p->knots;
    memcpy(k->current, p->current, sizeof k->current);
    memcpy(k->opening, p->opening, sizeof k->opening);
}

static inline void free_lift_set(free_lift *k, double load_kg, double temperature_degc)
{
    free_lift_from(k, &THESIS_FREE, load_kg, temperature_degc);
}

static inline void free_lift_at_rest(const free_lift *k, double start_m, double *y)
{
    memset(y, 0, STATES * sizeof *y);
    y[X] = start_m;
    y[PA] = k->weight / k->area;
    y[PB] = y[PA] / 2;
    y[AC] = k->a_leak;
}

/* Opening area of the proportional valve [m^2] and its slope over the current i [A]. */
static inline double valve_area(const free_lift *k, double i, double *slope)
{
    const double *at = k->current, *area = k->opening;
    const int last = (int)k->knots - 1;
    *slope = 0;
    if (i <= at[0]) return fmax(area[0], k->a_min);
    if (i >= at[last]) return fmax(area[last], k->a_min);
    int n = 0;
    while (i > at[n + 1]) n++;
    const double s = (area[n + 1] - area[n]) / (at[n + 1] - at[n]), a = area[n] + s * (i - at[n]);
    if (a < k->a_min) return k->a_min;
    *slope = s;
    return a;
}

/* Flow through an orifice [m^3/s], (3.7), and its derivatives over area and pressure drop. */
static inline double flow(double root, double kappa, double a, double p, double *over_a, double *over_p)
{
    const double p_cr = kappa / a, r = p * p + p_cr * p_cr, g = root / sqrt(sqrt(r));
    *over_a = g * p * (1 + 0.5 * p_cr * p_cr / r);
    *over_p = g * a * (1 - 0.5 * p * p / r);
    return g * a * p;
}

static inline void free_lift_rates(const free_lift *k, double u, const double *y, double *dy)
{
    double unused, over_a, over_p;
    const double dzv = y[DI] - k->s0_f * y[ZV] * fabs(y[DI]);
    const double a_v = valve_area(k, y[I], &unused), a_c = fmax(y[AC], 1e-15), p_c = y[PB] - k->p_tank;
    const double q_a = flow(k->root, k->kappa, a_v, y[PA] - y[PB], &over_a, &over_p);
    const double q_b = flow(k->root_c, k->kappa_c, a_c, p_c, &over_a, &over_p);
    const double a_s = k->a_max - k->slope * (y[PA] - y[PB] + p_c * a_c * k->c_flow - k->p_set);
    const double e_a = k->e_a * log(fmax(k->e_slope * y[PA] + k->e_offset, 1.05));
    const double g_s = k->friction * (1 + (k->k_brk - 1) * exp(-k->c_v * fabs(y[V])));
    const double dz = y[V] - k->sigma_0 * y[Z] / g_s * fabs(y[V]);
    dy[I] = y[DI];
    dy[DI] = k->w2 * (u - k->two_d_w * y[DI] - y[I] - k->s0 * y[ZV] - k->s1 * dzv);
    dy[ZV] = dzv;
    dy[X] = y[V];
    dy[V] = (y[PA] * k->area - k->weight - k->sigma_0 * y[Z] - k->sigma_1 * dz - k->sigma_2 * y[V]) / k->inertia;
    dy[Z] = dz;
    dy[PA] = e_a / fmax(k->v_0 + y[X] * k->area, 0.1 * k->v_0) * (-q_a - k->area * y[V]);
    dy[PB] = k->e_volume * (q_a - q_b);
    dy[AC] = (fmin(fmax(a_s, k->a_leak), k->a_max) - y[AC]) / k->tau;
}

/* d(dy)/d(y), column-major: jac[column * STATES + row]. */
static inline void free_lift_jacobian(const free_lift *k, const double *y, double *jac)
{
#define J(row, column) jac[(column) * STATES + (row)]
    double s_v, qa_a, qa_p, qb_a, qb_p;
    memset(jac, 0, STATES * STATES * sizeof *jac);
    const double sign_di = y[DI] < 0 ? -1 : 1, sign_v = y[V] < 0 ? -1 : 1;
    const double a_v = valve_area(k, y[I], &s_v), a_c = fmax(y[AC], 1e-15), p_c = y[PB] - k->p_tank;
    const double q_a = flow(k->root, k->kappa, a_v, y[PA] - y[PB], &qa_a, &qa_p);
    flow(k->root_c, k->kappa_c, a_c, p_c, &qb_a, &qb_p);

    J(I, DI) = 1;
    J(ZV, DI) = 1 - k->s0_f * y[ZV] * sign_di;
    J(ZV, ZV) = -k->s0_f * fabs(y[DI]);
    J(DI, I) = -k->w2;
    J(DI, DI) = k->w2 * (-k->two_d_w - k->s1 * J(ZV, DI));
    J(DI, ZV) = k->w2 * (-k->s0 - k->s1 * J(ZV, ZV));

    const double e = (k->k_brk - 1) * exp(-k->c_v * fabs(y[V])), g_s = k->friction * (1 + e);
    const double over_v = (1 + k->c_v * fabs(y[V]) * e / (1 + e)) / g_s; /* d(|v| / g_s) / d|v| */
    J(X, V) = 1;
    J(Z, V) = 1 - k->sigma_0 * y[Z] * over_v * sign_v;
    J(Z, Z) = -k->sigma_0 * fabs(y[V]) / g_s;
    J(V, V) = (-k->sigma_1 * J(Z, V) - k->sigma_2) / k->inertia;
    J(V, Z) = (-k->sigma_0 - k->sigma_1 * J(Z, Z)) / k->inertia;
    J(V, PA) = k->area / k->inertia;

    const double arg = fmax(k->e_slope * y[PA] + k->e_offset, 1.05), vol = fmax(k->v_0 + y[X] * k->area, 0.1 * k->v_0);
    const double stiff = k->e_a * log(arg) / vol, net = -q_a - k->area * y[V];
    J(PA, I) = -stiff * qa_a * s_v;
    J(PA, X) = -stiff * net * k->area / vol;
    J(PA, V) = -stiff * k->area;
    J(PA, PA) = -stiff * qa_p + k->e_a * k->e_slope / arg / vol * net;
    J(PA, PB) = stiff * qa_p;

    J(PB, I) = k->e_volume * qa_a * s_v;
    J(PB, PA) = k->e_volume * qa_p;
    J(PB, PB) = -k->e_volume * (qa_p + qb_p);
    J(PB, AC) = -k->e_volume * qb_a;

    const double a_s = k->a_max - k->slope * (y[PA] - y[PB] + p_c * a_c * k->c_flow - k->p_set);
    J(AC, AC) = -1 / k->tau;
    if (a_s > k->a_leak && a_s < k->a_max) {
        J(AC, PA) = -k->slope / k->tau;
        J(AC, PB) = -k->slope * (-1 + a_c * k->c_flow) / k->tau;
        J(AC, AC) -= k->slope * p_c * k->c_flow / k->tau;
    }
#undef J
}

#endif
