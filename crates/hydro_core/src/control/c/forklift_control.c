/* The controller of a forklift's lowering function, in fixed point: see forklift_control.h.
 *
 * configuration   @HASH@
 */
#include "forklift_control.h"

#define FC_SPEED_ONE ((int64_t)@SPEED_ONE@)
#define FC_CURRENT_ONE ((int64_t)@CURRENT_ONE@)
#define FC_FACTOR_ONE ((int64_t)@FACTOR_ONE@)
#define FC_INTEGRAL_ONE ((int64_t)16777216)
#define FC_PRESSURE_ONE ((int64_t)65536)
#define FC_TEMPERATURE_ONE ((int64_t)65536)
#define FC_MOST_SPEED (4095 * FC_SPEED_ONE)
#define FC_MOST_CURRENT (2047 * FC_CURRENT_ONE)
#define FC_MOST_FACTOR ((4 * FC_FACTOR_ONE) - 1)
#define FC_MEAN_REST ((int64_t)31)
#define FC_MOST_TRIM ((int64_t)268435456)
#define FC_MOST_COUNTS ((int64_t)64)
#define FC_MOST_PRESSURE ((int64_t)10000)
#define FC_MOST_PRESSURE_CHANGE ((int64_t)1000)
#define FC_MOST_RESONANCE (16000 * FC_PRESSURE_ONE)
#define FC_SHAPER_ONE ((int64_t)65536)
#define FC_LEAST_REFERENCE (FC_SPEED_ONE / 16)
#define FC_MOST_SHAPED (30 * FC_SHAPER_ONE)

@TABLES@
const uint64_t fc_configuration = @HASH@ULL;
const fc_config fc_controller = @CONFIG@;

/* (size + more) / 2^shift without its fraction, of a size that is not negative. */
static int64_t fc_shifted(int64_t size, uint64_t more, uint32_t shift)
{
    const uint64_t whole = (uint64_t)size;
    const uint64_t shifted = (whole + more) >> shift;
    return (int64_t)shifted;
}

/* x / 2^shift to the nearest, halves away from zero. */
static int64_t fc_rounded(int64_t x, uint32_t shift)
{
    const uint64_t half = ((uint64_t)1U << shift) >> 1U;
    int64_t nearest;
    if (x < 0) {
        nearest = -fc_shifted(-x, half, shift);
    } else {
        nearest = fc_shifted(x, half, shift);
    }
    return nearest;
}

/* x / 2^shift towards zero. */
static int64_t fc_truncated(int64_t x, uint32_t shift)
{
    int64_t nearest;
    if (x < 0) {
        nearest = -fc_shifted(-x, 0U, shift);
    } else {
        nearest = fc_shifted(x, 0U, shift);
    }
    return nearest;
}

static int64_t fc_clamped(int64_t x, int64_t lower, int64_t upper)
{
    int64_t nearest = x;
    if (x < lower) {
        nearest = lower;
    } else if (x > upper) {
        nearest = upper;
    } else {
        /* within */
    }
    return nearest;
}

static int64_t fc_saturated(int64_t x, int64_t most)
{
    return fc_clamped(x, -most, most);
}

static int64_t fc_times(fc_gain gain, int64_t x)
{
    return fc_rounded((int64_t)gain.mantissa * x, gain.shift);
}

static int64_t fc_table_at(const fc_table *table, int64_t x)
{
    const int64_t segments = (int64_t)table->segments;
    const uint64_t spaced = (uint64_t)1U << table->spacing;
    const int64_t distance = (int64_t)spaced;
    const int64_t from = fc_clamped(x - (int64_t)table->first, 0, segments * distance);
    const int64_t segment = fc_clamped(fc_truncated(from, table->spacing), 0, segments - 1);
    const uint64_t widened = (uint64_t)1U << table->widen;
    const int64_t low = (int64_t)table->knots[segment] * (int64_t)widened;
    const int64_t high = (int64_t)table->knots[segment + 1] * (int64_t)widened;
    /* Within these limits by the clamps above: said once more for whoever works out ranges. */
    const int64_t into = fc_clamped(from - (segment * distance), 0, distance);
    return low + fc_rounded((high - low) * into, table->spacing);
}

/* The difference of the encoder's counts as a lowering speed, low-passed. */
static int64_t fc_filtered_speed(const fc_lift_config *config, fc_lift_state *state, int32_t position)
{
    const int64_t counts = fc_saturated((int64_t)state->position - (int64_t)position, FC_MOST_COUNTS);
    const int64_t raw = fc_saturated((int64_t)config->count_speed * counts, FC_MOST_SPEED);
    const int64_t pole = (int64_t)config->pole;
    const int64_t sum = (pole * (int64_t)state->speed) + ((FC_FACTOR_ONE - pole) * raw);
    state->position = position;
    state->speed = (int32_t)fc_saturated(fc_truncated(sum, FC_FACTOR_SHIFT), FC_MOST_SPEED);
    return (int64_t)state->speed;
}

/* What the cylinder's pressure swings by, as a speed. */
static int64_t fc_swing(const fc_lift_config *config, fc_lift_state *state, int32_t reading)
{
    const fc_pressure_config *p = &config->pressure;
    const int64_t pressure = fc_clamped((int64_t)reading, 0, FC_MOST_PRESSURE);
    const int64_t change = fc_saturated(pressure - (int64_t)state->pressure, FC_MOST_PRESSURE_CHANGE);
    const int64_t renewed = ((int64_t)state->mean * FC_MEAN_REST) + (pressure * FC_PRESSURE_ONE);
    const int64_t c = (int64_t)state->cosine;
    const int64_t s = (int64_t)state->sine;
    int64_t mean;
    int64_t cosine;
    int64_t sine;
    int64_t turned;
    int64_t sum;
    state->pressure = (int32_t)pressure;
    state->mean = (int32_t)fc_clamped(fc_truncated(renewed, FC_MEAN_SHIFT), 0, FC_MOST_PRESSURE * FC_PRESSURE_ONE);
    mean = (int64_t)state->mean;
    cosine = fc_table_at(&p->cosine, mean);
    sine = fc_table_at(&p->sine, mean);
    turned = fc_truncated((cosine * c) - (sine * s), FC_FACTOR_SHIFT) + (change * FC_PRESSURE_ONE);
    state->cosine = (int32_t)fc_saturated(turned, FC_MOST_RESONANCE);
    turned = fc_truncated((sine * c) + (cosine * s), FC_FACTOR_SHIFT);
    state->sine = (int32_t)fc_saturated(turned, FC_MOST_RESONANCE);
    sum = (fc_table_at(&p->real, mean) * (int64_t)state->cosine)
        + (fc_table_at(&p->imaginary, mean) * (int64_t)state->sine);
    return fc_saturated(fc_rounded(sum, p->shift), (int64_t)p->limit);
}

/* What a ring held some ticks before its newest; within these limits by what is written to it: said once more for
 * whoever works out ranges. */
static int64_t fc_past(const int32_t ring[FC_PAST], uint32_t newest, uint32_t ticks)
{
    return fc_saturated((int64_t)ring[((newest + FC_PAST) - ticks) % FC_PAST], FC_MOST_SPEED);
}

/* What a ring holds now and held half a period ago, so that a swing of that period does not pass. */
static int64_t fc_shaped(const fc_lift_config *config, const fc_lift_state *state, const int32_t ring[FC_PAST],
                         uint32_t newest)
{
    const int64_t mean = (int64_t)state->mean;
    const int64_t delay = fc_clamped(fc_table_at(&config->shaper_delay, mean), 0, FC_MOST_SHAPED);
    const int64_t share = fc_table_at(&config->shaper_share, mean);
    const int64_t whole = fc_truncated(delay, FC_SHAPER_SHIFT);
    /* Within these limits by the truncation above: said once more for whoever works out ranges. */
    const int64_t into = fc_clamped(delay - (whole * FC_SHAPER_ONE), 0, FC_SHAPER_ONE - 1);
    const int64_t both = (fc_past(ring, newest, (uint32_t)whole) * (FC_SHAPER_ONE - into))
                       + (fc_past(ring, newest, (uint32_t)whole + 1U) * into);
    const int64_t late = fc_rounded(both, FC_SHAPER_SHIFT);
    const int64_t now = fc_past(ring, newest, 0U);
    return fc_rounded((share * now) + ((FC_FACTOR_ONE - share) * late), FC_FACTOR_SHIFT);
}

/* Corrections that are ordered and have not come back as a speed. */
static int64_t fc_not_shown_yet(const fc_lift_config *config, const fc_lift_state *state, uint32_t newest)
{
    const int64_t last = fc_past(state->corrections, newest, 1U);
    const int64_t shown = fc_past(state->corrections, newest, 1U + config->delay);
    return fc_rounded((int64_t)config->prediction * (last - shown), FC_FACTOR_SHIFT);
}

/* The error that is summed: what is too fast counts more. */
static int64_t fc_summed_error(const fc_lift_config *config, int64_t error, int64_t speed)
{
    const int64_t over = fc_clamped(speed - (int64_t)config->overspeed_from, 0, FC_MOST_SPEED);
    return fc_saturated(error - fc_times(config->overspeed, over), FC_MOST_SPEED);
}

/* Moves a little of the integral part into the feed-forward's trim. */
static int64_t fc_learn(const fc_lift_config *config, fc_lift_state *state, int64_t reference)
{
    const int64_t integral = fc_saturated(fc_rounded(state->integral, FC_INTEGRAL_SHIFT), FC_MOST_SPEED);
    const int64_t product = fc_rounded(integral * reference, (2U * FC_SPEED_SHIFT) - FC_LEARNING_SHIFT);
    const int64_t trim = fc_saturated((int64_t)state->trim + fc_times(config->adaptation, product), FC_MOST_TRIM);
    const int64_t moved = trim - (int64_t)state->trim;
    state->trim = (int32_t)trim;
    return fc_truncated(moved * reference, FC_TRIM_SHIFT - FC_INTEGRAL_SHIFT);
}

/* PID, feed-forward and what the pressure adds, within the limits. */
static int64_t fc_order(const fc_lift_config *config, fc_lift_state *state, int64_t reference, int64_t error,
                        int64_t summed, int64_t swing, uint32_t newest)
{
    const int64_t slope = error - (int64_t)state->error;
    const int64_t proportional = fc_saturated(fc_times(config->proportional, error), FC_MOST_SPEED);
    const int64_t derivative = fc_saturated(fc_times(config->derivative, slope), FC_MOST_SPEED);
    const int64_t sum = proportional + derivative + fc_rounded(state->integral, FC_INTEGRAL_SHIFT);
    const int64_t pid = fc_saturated(sum, FC_MOST_SPEED);
    const int64_t trim = fc_rounded((int64_t)state->trim * reference, FC_TRIM_SHIFT);
    const int64_t wanted = reference + trim + pid + swing;
    const int64_t u = fc_clamped(wanted, (int64_t)config->u_min, (int64_t)config->u_max);
    const int64_t learnt = fc_learn(config, state, reference);
    const uint64_t exact = (uint64_t)1U << (FC_INTEGRAL_SHIFT - config->integral.shift);
    const int64_t step = ((int64_t)config->integral.mantissa * summed) * (int64_t)exact;
    const int64_t tracked = ((state->integral - learnt) + step) + ((u - wanted) * FC_INTEGRAL_ONE);
    state->error = (int32_t)error;
    state->integral = fc_saturated(tracked, FC_MOST_SPEED * FC_INTEGRAL_ONE); /* integrator's clamp */
    state->corrections[newest] = (int32_t)fc_saturated((pid + u) - wanted, FC_MOST_SPEED);
    return u;
}

/* From a speed to the valve's current [mA]. */
static int32_t fc_current(const fc_lift_config *config, int64_t u, int64_t temperature)
{
    const int64_t warm = temperature * FC_TEMPERATURE_ONE;
    const int64_t sloped = (int64_t)config->scale_base + fc_times(config->scale_slope, warm);
    const int64_t factor = fc_clamped(sloped, 0, FC_MOST_FACTOR);
    const int64_t scaled = fc_saturated(fc_rounded(factor * u, FC_FACTOR_SHIFT), FC_MOST_SPEED);
    const int64_t shift = fc_saturated(fc_times(config->shift_slope, warm), FC_MOST_CURRENT);
    const int64_t order = fc_table_at(&config->table, scaled) + (int64_t)config->shift_base + shift;
    return (int32_t)fc_rounded(fc_clamped(order, (int64_t)config->i_min, (int64_t)config->i_max), FC_CURRENT_SHIFT);
}

static int32_t fc_lift_tick(const fc_lift_config *config, fc_lift_state *state, int32_t asked, int32_t position,
                            int32_t pressure, int32_t temperature)
{
    const uint32_t newest = state->oldest % FC_PAST;
    int32_t current = 0;
    int64_t speed;
    int64_t swing;
    int64_t reference;
    if (state->started == 0U) {
        state->position = position;
        state->pressure = (int32_t)fc_clamped((int64_t)pressure, 0, FC_MOST_PRESSURE);
        state->mean = (int32_t)((int64_t)state->pressure * FC_PRESSURE_ONE);
        state->started = 1U;
    }
    speed = fc_filtered_speed(config, state, position);
    swing = fc_swing(config, state, pressure);
    state->oldest = (newest + 1U) % FC_PAST;
    state->asked[newest] = asked;
    reference = fc_clamped(fc_shaped(config, state, state->asked, newest), 0, (int64_t)config->most);
    state->references[newest] = (int32_t)reference;
    if (reference == 0) {
        uint32_t k;
        /* The valve is shut, and nothing may be left over for the next lowering. */
        state->integral = 0;
        state->error = 0;
        for (k = 0U; k < FC_PAST; k++) {
            state->corrections[k] = 0;
        }
    } else {
        const int64_t late = fc_past(state->references, newest, config->delay) - speed;
        const int64_t error = fc_saturated(late - fc_not_shown_yet(config, state, newest), FC_MOST_SPEED);
        const int64_t summed = fc_summed_error(config, error, speed);
        const int64_t u = fc_order(config, state, reference, error, summed, swing, newest);
        current = fc_current(config, u, (int64_t)temperature);
    }
    return current;
}

/* The ramp through a low-pass of that pole. */
static int32_t fc_passed(int32_t ramp, int32_t pole, int32_t state, int64_t most)
{
    const int64_t sum = ((int64_t)pole * (int64_t)state)
                      + ((FC_FACTOR_ONE - (int64_t)pole) * (int64_t)ramp);
    return (int32_t)fc_clamped(fc_truncated(sum, FC_FACTOR_SHIFT), 0, most);
}

/* A lift's share of a low-passed ramp, of which the last bits do not hold a valve open. */
static int32_t fc_share(const fc_table *ratio, int64_t height, int32_t state)
{
    const int64_t passed = (int64_t)state;
    const int64_t reference = (passed < FC_LEAST_REFERENCE) ? 0 : passed;
    return (int32_t)fc_rounded(fc_table_at(ratio, height) * reference, FC_FACTOR_SHIFT);
}

/* A ramp with rounded edges, shared between the lifts: what the operator is used to, and what is to be shaped. */
static void fc_references(const fc_config *config, fc_state *state, int32_t request, int64_t height,
                          int32_t shares[2])
{
    const int64_t most = (int64_t)config->request_most;
    const int64_t asked = fc_clamped((int64_t)request, 0, fc_truncated(most, FC_SPEED_SHIFT))
                        * FC_SPEED_ONE;
    const int64_t change =
        fc_clamped(asked - (int64_t)state->ramp, -(int64_t)config->ramp_down, (int64_t)config->ramp_up);
    uint32_t k;
    state->ramp = (int32_t)fc_clamped((int64_t)state->ramp + change, 0, most);
    state->smooth = fc_passed(state->ramp, config->ramp_pole, state->smooth, most);
    for (k = 0U; k < 2U; k++) {
        state->early[k] = fc_passed(state->ramp, config->lifts[k].early_pole, state->early[k], most);
        state->wanted[k] = fc_share(&config->ratio[k], height, state->smooth);
        shares[k] = fc_share(&config->ratio[k], height, state->early[k]);
    }
}

void fc_tick(const fc_config *config, fc_state *state, int32_t request, const fc_reading *reading, int32_t current[2])
{
    const int64_t height = (int64_t)reading->position[0] + (2 * (int64_t)reading->position[1]);
    const int64_t temperature = fc_clamped((int64_t)reading->temperature, (int64_t)config->temperature_least,
                                           (int64_t)config->temperature_most);
    int32_t asked[2] = { 0, 0 };
    uint32_t k;
    fc_references(config, state, request, height, asked);
    for (k = 0U; k < 2U; k++) {
        current[k] = fc_lift_tick(&config->lifts[k], &state->lifts[k], asked[k], reading->position[k],
                                  reading->pressure[k], (int32_t)temperature);
    }
}
