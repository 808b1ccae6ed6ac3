/* The free lift of the thesis in plain C: right-hand side and analytic Jacobian, for the peers of the bench.
 *
 * Fri & Fahlén, LiTH-ISY-EX--17/5050--SE, 2017, chapter 3, values of Table 5.1. States, SI units:
 * i [A], di/dt [A/s], z_valve [A], x [m], v [m/s], z [m], p_A [Pa], p_B [Pa], A_comp [m^2].
 * What does not change within a lowering is computed once, in free_lift_set. */
#ifndef FREE_LIFT_H
#define FREE_LIFT_H

#include <math.h>
#include <string.h>

enum { I, DI, ZV, X, V, Z, PA, PB, AC, STATES };

typedef struct {
    double kappa, kappa_c;   /* p_cr = kappa / area, of valve and compensator [Pa m^2] */
    double weight, inertia;  /* [N], [kg] */
    double friction;         /* F_pr + m f_cfr [N] */
    double c_flow;           /* C_D cos(theta) / A_spool of the compensator [1/m^2] */
    double root, root_c;     /* C_D sqrt(2 / rho) of valve and compensator */
} free_lift;

#define W 34.327
#define F_HS 0.018723
#define S0_H 0.5
#define S1_H 0.1
#define A_CYL (M_PI * 0.0275 * 0.0275)
#define V_0 0.0055302
#define A1_E (0.15703 * 18000e5)
#define A2_P (11.841 / 280e5)
#define A_3 367.5
#define E_V (7e8 / 2000e-9)
#define P_D 1e5
#define A_MAX 100e-6
#define A_LEAK 1e-9
#define A_FLOOR 1e-9
#define P_SET 5.4e5
#define SLOPE ((A_MAX - A_LEAK) / 2.7e5)
#define TAU 0.01
#define K_BRK 3.769
#define C_V 261.2
#define SIGMA_0 2517.2
#define SIGMA_1 14342.0
#define SIGMA_2 4137.8

static inline void free_lift_set(free_lift *k, double load_kg, double temperature_degc)
{
    const double rho = 860.0, m = 278.0 + load_kg, c_d = 0.67, c_dc = 0.84417;
    const double nu = 4.45e-5 * exp(-0.0050814 * (temperature_degc + 273.0 - 293.0)); /* (3.1) */
    const double re = 5543.9 * nu / c_d, re_c = 18546.0 * nu / c_dc;
    k->kappa = rho / 2 * re * re * M_PI / 4; /* (3.8), (3.9) */
    k->kappa_c = rho / 2 * re_c * re_c * M_PI / 4;
    k->weight = (12.6 + 2 * m) * 9.82;
    k->inertia = 12.6 + 4 * m;
    k->friction = 113.81 + m * 2.6445;
    k->c_flow = c_dc * cos(0.63222) / 3.14e-4;
    k->root = c_d * sqrt(2 / rho);
    k->root_c = c_dc * sqrt(2 / rho);
}

static inline void free_lift_at_rest(const free_lift *k, double *y)
{
    memset(y, 0, STATES * sizeof *y);
    y[X] = 0.98;
    y[PA] = k->weight / A_CYL;
    y[PB] = y[PA] / 2;
    y[AC] = A_LEAK;
}

/* Opening area of the proportional valve [m^2] and its slope over the current i [A]. */
static inline double valve_area(double i, double *slope)
{
    static const double at[8] = {0, 0.36, 0.45, 0.60, 0.80, 1.0, 1.2, 1.4};
    static const double area[8] = {0, 0, 0.13e-5, 0.66e-5, 1.55e-5, 2.6e-5, 3.7e-5, 4.4e-5};
    *slope = 0;
    if (i <= at[1]) return A_FLOOR;
    if (i >= at[7]) return area[7];
    int n = 1;
    while (i > at[n + 1]) n++;
    const double s = (area[n + 1] - area[n]) / (at[n + 1] - at[n]), a = area[n] + s * (i - at[n]);
    if (a < A_FLOOR) return A_FLOOR;
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
    const double dzv = y[DI] - S0_H / F_HS * y[ZV] * fabs(y[DI]);
    const double a_v = valve_area(y[I], &unused), a_c = fmax(y[AC], 1e-15), p_c = y[PB] - P_D;
    const double q_a = flow(k->root, k->kappa, a_v, y[PA] - y[PB], &over_a, &over_p);
    const double q_b = flow(k->root_c, k->kappa_c, a_c, p_c, &over_a, &over_p);
    const double a_s = A_MAX - SLOPE * (y[PA] - y[PB] + p_c * a_c * k->c_flow - P_SET);
    const double e_a = A1_E * log(A2_P * y[PA] + A_3);
    const double g_s = k->friction * (1 + (K_BRK - 1) * exp(-C_V * fabs(y[V])));
    const double dz = y[V] - SIGMA_0 * y[Z] / g_s * fabs(y[V]);
    dy[I] = y[DI];
    dy[DI] = W * W * (u - 2 / W * y[DI] - y[I] - S0_H * y[ZV] - S1_H * dzv);
    dy[ZV] = dzv;
    dy[X] = y[V];
    dy[V] = (y[PA] * A_CYL - k->weight - SIGMA_0 * y[Z] - SIGMA_1 * dz - SIGMA_2 * y[V]) / k->inertia;
    dy[Z] = dz;
    dy[PA] = e_a / (V_0 + y[X] * A_CYL) * (-q_a - A_CYL * y[V]);
    dy[PB] = E_V * (q_a - q_b);
    dy[AC] = (fmin(fmax(a_s, A_LEAK), A_MAX) - y[AC]) / TAU;
}

/* d(dy)/d(y), column-major: jac[column * STATES + row]. */
static inline void free_lift_jacobian(const free_lift *k, const double *y, double *jac)
{
#define J(row, column) jac[(column) * STATES + (row)]
    double s_v, qa_a, qa_p, qb_a, qb_p;
    memset(jac, 0, STATES * STATES * sizeof *jac);
    const double sign_di = y[DI] < 0 ? -1 : 1, sign_v = y[V] < 0 ? -1 : 1;
    const double a_v = valve_area(y[I], &s_v), a_c = fmax(y[AC], 1e-15), p_c = y[PB] - P_D;
    const double q_a = flow(k->root, k->kappa, a_v, y[PA] - y[PB], &qa_a, &qa_p);
    flow(k->root_c, k->kappa_c, a_c, p_c, &qb_a, &qb_p);

    J(I, DI) = 1;
    J(ZV, DI) = 1 - S0_H / F_HS * y[ZV] * sign_di;
    J(ZV, ZV) = -S0_H / F_HS * fabs(y[DI]);
    J(DI, I) = -W * W;
    J(DI, DI) = W * W * (-2 / W - S1_H * J(ZV, DI));
    J(DI, ZV) = W * W * (-S0_H - S1_H * J(ZV, ZV));

    const double e = (K_BRK - 1) * exp(-C_V * fabs(y[V])), g_s = k->friction * (1 + e);
    const double over_v = (1 + C_V * fabs(y[V]) * e / (1 + e)) / g_s; /* d(|v| / g_s) / d|v| */
    J(X, V) = 1;
    J(Z, V) = 1 - SIGMA_0 * y[Z] * over_v * sign_v;
    J(Z, Z) = -SIGMA_0 * fabs(y[V]) / g_s;
    J(V, V) = (-SIGMA_1 * J(Z, V) - SIGMA_2) / k->inertia;
    J(V, Z) = (-SIGMA_0 - SIGMA_1 * J(Z, Z)) / k->inertia;
    J(V, PA) = A_CYL / k->inertia;

    const double arg = A2_P * y[PA] + A_3, vol = V_0 + y[X] * A_CYL;
    const double stiff = A1_E * log(arg) / vol, net = -q_a - A_CYL * y[V];
    J(PA, I) = -stiff * qa_a * s_v;
    J(PA, X) = -stiff * net * A_CYL / vol;
    J(PA, V) = -stiff * A_CYL;
    J(PA, PA) = -stiff * qa_p + A1_E * A2_P / arg / vol * net;
    J(PA, PB) = stiff * qa_p;

    J(PB, I) = E_V * qa_a * s_v;
    J(PB, PA) = E_V * qa_p;
    J(PB, PB) = -E_V * (qa_p + qb_p);
    J(PB, AC) = -E_V * qb_a;

    const double a_s = A_MAX - SLOPE * (y[PA] - y[PB] + p_c * a_c * k->c_flow - P_SET);
    J(AC, AC) = -1 / TAU;
    if (a_s > A_LEAK && a_s < A_MAX) {
        J(AC, PA) = -SLOPE / TAU;
        J(AC, PB) = -SLOPE * (-1 + a_c * k->c_flow) / TAU;
        J(AC, AC) -= SLOPE * p_c * k->c_flow / TAU;
    }
#undef J
}

#endif
