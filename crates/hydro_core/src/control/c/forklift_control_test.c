/* Ticks of forklift_control.c from random states, compared by a digest with those of its reference.
 *
 * configuration   @HASH@
 * Returns 0 where the digests are equal. FC_TICKS and FC_EXPECTED may be set on the compiler's command line.
 */
#include "forklift_control.h"

#ifndef FC_TICKS
#define FC_TICKS @TICKS@U
#endif
#ifndef FC_EXPECTED
#define FC_EXPECTED @DIGEST@ULL
#endif
#ifndef FC_SEED
#define FC_SEED @SEED@ULL
#endif

static uint64_t draws;

static uint64_t next_draw(void)
{
    draws ^= draws << 13U;
    draws ^= draws >> 7U;
    draws ^= draws << 17U;
    return draws;
}

static int64_t around(int64_t most)
{
    const uint64_t drawn = next_draw();
    const uint64_t size = (drawn >> 8U) % ((2U * (uint64_t)most) + 1U);
    const uint64_t kind = drawn & 31U;
    int64_t value = (int64_t)size - most;
    if (kind == 0U) {
        value = -most;
    } else if (kind == 1U) {
        value = most;
    } else if (kind <= 3U) {
        value = 0;
    } else {
        /* anywhere */
    }
    return value;
}

static int64_t up_to(int64_t most)
{
    const int64_t value = around(most);
    return (value < 0) ? -value : value;
}

static int32_t any_word(void)
{
    return (int32_t)around(INT32_MAX);
}

static void draw_state(const fc_config *config, fc_state *state)
{
    const int64_t most = config->request_most;
    const int64_t pressure = 65536;
    const int64_t speed = 4095 * ((int64_t)1 << FC_SPEED_SHIFT);
    uint32_t k;
    uint32_t j;
    state->smooth = (int32_t)up_to(most);
    state->early[0] = (int32_t)up_to(most);
    state->early[1] = (int32_t)up_to(most);
    state->ramp = (int32_t)up_to(most);
    state->wanted[0] = (int32_t)up_to(most);
    state->wanted[1] = (int32_t)up_to(most);
    for (k = 0U; k < 2U; k++) {
        fc_lift_state *lift = &state->lifts[k];
        lift->started = ((next_draw() & 15U) != 0U) ? 1U : 0U;
        lift->position = any_word();
        lift->pressure = (int32_t)up_to(10000);
        lift->speed = (int32_t)around(speed);
        for (j = 0U; j < FC_PAST; j++) {
            lift->asked[j] = (int32_t)up_to(most);
        }
        for (j = 0U; j < FC_PAST; j++) {
            lift->references[j] = (int32_t)up_to(most);
        }
        for (j = 0U; j < FC_PAST; j++) {
            lift->corrections[j] = (int32_t)around(speed);
        }
        lift->oldest = (uint32_t)(next_draw() % FC_PAST);
        lift->error = (int32_t)around(speed);
        lift->integral = around(speed * ((int64_t)1 << FC_INTEGRAL_SHIFT));
        lift->trim = (int32_t)around((int64_t)1 << (FC_TRIM_SHIFT - 2U));
        lift->mean = (int32_t)up_to(10000 * pressure);
        lift->cosine = (int32_t)around(16000 * pressure);
        lift->sine = (int32_t)around(16000 * pressure);
    }
}

static int32_t draw_reading(const fc_state *state, fc_reading *reading)
{
    const int32_t request = ((next_draw() & 1U) == 0U) ? (int32_t)up_to(1000) : any_word();
    uint32_t k;
    for (k = 0U; k < 2U; k++) {
        const uint32_t near = (uint32_t)state->lifts[k].position + (uint32_t)(int32_t)around(80);
        const int64_t wrapped = (near > (uint32_t)INT32_MAX) ? ((int64_t)near - 4294967296LL) : (int64_t)near;
        reading->position[k] = ((next_draw() & 3U) == 0U) ? any_word() : (int32_t)wrapped;
        reading->pressure[k] = ((next_draw() & 3U) == 0U) ? any_word() : (int32_t)up_to(10000);
    }
    reading->temperature = ((next_draw() & 3U) == 0U) ? any_word() : (int32_t)around(200);
    return request;
}

static uint64_t fold(uint64_t digest, int64_t value)
{
    return (digest ^ (uint64_t)value) * 0x100000001b3ULL;
}

static uint64_t folded(uint64_t start, const fc_state *state, const int32_t current[2])
{
    uint64_t digest = start;
    uint32_t k;
    uint32_t j;
    digest = fold(digest, state->ramp);
    digest = fold(digest, state->smooth);
    digest = fold(digest, state->early[0]);
    digest = fold(digest, state->early[1]);
    digest = fold(digest, state->wanted[0]);
    digest = fold(digest, state->wanted[1]);
    for (k = 0U; k < 2U; k++) {
        const fc_lift_state *lift = &state->lifts[k];
        digest = fold(digest, (int64_t)lift->started);
        digest = fold(digest, lift->position);
        digest = fold(digest, lift->pressure);
        digest = fold(digest, lift->speed);
        for (j = 0U; j < FC_PAST; j++) {
            digest = fold(digest, lift->asked[j]);
        }
        for (j = 0U; j < FC_PAST; j++) {
            digest = fold(digest, lift->references[j]);
        }
        for (j = 0U; j < FC_PAST; j++) {
            digest = fold(digest, lift->corrections[j]);
        }
        digest = fold(digest, (int64_t)lift->oldest);
        digest = fold(digest, lift->error);
        digest = fold(digest, lift->integral);
        digest = fold(digest, lift->trim);
        digest = fold(digest, lift->mean);
        digest = fold(digest, lift->cosine);
        digest = fold(digest, lift->sine);
    }
    digest = fold(digest, current[0]);
    return fold(digest, current[1]);
}

int main(void)
{
    uint64_t digest = 0xcbf29ce484222325ULL;
    uint64_t tick;
    draws = FC_SEED;
    for (tick = 0U; tick < FC_TICKS; tick++) {
        fc_state state;
        fc_reading reading;
        int32_t current[2];
        int32_t request;
        draw_state(&fc_controller, &state);
        request = draw_reading(&state, &reading);
        fc_tick(&fc_controller, &state, request, &reading, current);
        digest = folded(digest, &state, current);
    }
    return (digest == FC_EXPECTED) ? 0 : 1;
}
