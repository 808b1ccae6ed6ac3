/* The controller of a forklift's lowering function, in fixed point.
 *
 * After Fri & Fahlen, Modelling and Control of a Forklift's Hydraulic Lowering Function (Linkoping University,
 * LiTH-ISY-EX--17/5050--SE, 2017), chapter 4. One call of fc_tick every 20 ms answers one reading of the sensors.
 * No floating point, no allocation, no division by a variable; no operation overflows for any reading, any request
 * and any state that fc_tick has left behind.
 *
 * controller      @NAME@
 * configuration   @HASH@
 * word            @BITS@ bits for gains and tables, 32 for signals and states, 64 for sums of products
 *
@GAINS@ */
#ifndef FORKLIFT_CONTROL_H
#define FORKLIFT_CONTROL_H

#include <stdint.h>

/* Scales: a value of scale q stands for value / 2^q. */
#define FC_SPEED_SHIFT @SPEED@U /* speeds [mm/s] */
#define FC_CURRENT_SHIFT @CURRENT@U /* currents [mA] */
#define FC_FACTOR_SHIFT @FACTOR@U /* factors */
#define FC_INTEGRAL_SHIFT 24U /* the integrator's bits below a speed's */
#define FC_TRIM_SHIFT 30U /* the trim of the feed-forward */
#define FC_LEARNING_SHIFT 6U /* the product of two speeds that moves it */
#define FC_MEAN_SHIFT 5U /* what a tick renews of the mean pressure: 2^-5 */
#define FC_SHAPER_SHIFT 16U /* fractions of a tick */
#define FC_PAST 32U /* ticks that are remembered */

typedef int@BITS@_t fc_word;

/* A factor: mantissa / 2^shift. */
typedef struct {
    fc_word mantissa;
    uint8_t shift;
} fc_gain;

/* y over x, straight between the knots: at first + k * 2^spacing it is knot k times 2^widen. */
typedef struct {
    int32_t first;
    uint8_t spacing;
    uint8_t widen;
    uint8_t segments;
    const fc_word *knots;
} fc_table;

typedef struct {
    fc_table cosine;
    fc_table sine;
    fc_table real;
    fc_table imaginary;
    uint8_t shift;
    int32_t limit;
} fc_pressure_config;

typedef struct {
    int32_t most;
    int32_t early_pole;
    fc_table shaper_delay;
    fc_table shaper_share;
    int32_t prediction;
    fc_gain overspeed;
    int32_t overspeed_from;
    int32_t count_speed;
    int32_t pole;
    uint32_t delay;
    fc_gain proportional;
    fc_gain integral;
    fc_gain derivative;
    int32_t u_min;
    int32_t u_max;
    fc_gain adaptation;
    int32_t scale_base;
    fc_gain scale_slope;
    fc_table table;
    int32_t shift_base;
    fc_gain shift_slope;
    int32_t i_min;
    int32_t i_max;
    fc_pressure_config pressure;
} fc_lift_config;

typedef struct {
    int32_t request_most;
    int32_t ramp_up;
    int32_t ramp_down;
    int32_t ramp_pole;
    int32_t temperature_least;
    int32_t temperature_most;
    fc_table ratio[2];
    fc_lift_config lifts[2];
} fc_config;

/* What a lift's controller remembers; all zero before the first tick. */
typedef struct {
    uint32_t started;
    int32_t position;
    int32_t pressure;
    int32_t speed;
    int32_t asked[FC_PAST];
    int32_t references[FC_PAST];
    int32_t corrections[FC_PAST];
    uint32_t oldest;
    int32_t error;
    int64_t integral;
    int32_t trim;
    int32_t mean;
    int32_t cosine;
    int32_t sine;
} fc_lift_state;

typedef struct {
    int32_t ramp;
    int32_t smooth;
    int32_t early[2];
    int32_t wanted[2];
    fc_lift_state lifts[2];
} fc_state;

/* What the sensors read; free and main lift. */
typedef struct {
    int32_t position[2]; /* encoder counts, upward positive */
    int32_t pressure[2]; /* steps of @PRESSURE@ bar */
    int32_t temperature; /* steps of @TEMPERATURE@ K, from 0 degC */
} fc_reading;

/* The configuration's hash: the same in the controller's file and in its simulation. */
extern const uint64_t fc_configuration;
extern const fc_config fc_controller;

/* One tick: the valves' currents [mA] for a lowering speed asked for [mm/s]. */
void fc_tick(const fc_config *config, fc_state *state, int32_t request, const fc_reading *reading, int32_t current[2]);

#endif
