/* Helpers of forklift_control.c over every pair of 16-bit arguments, compared by a digest with those of its reference.
 *
 * configuration   @HASH@
 * FC_HELPER is one of the names below, FC_SHIFT a shift, FC_FIRST to FC_LAST the upper halves that are run, FC_EXPECTED
 * the digest. Returns 0 where the digests are equal.
 */
#include "forklift_control.c"

#define FC_TIMES 0
#define FC_ROUNDED 1
#define FC_TRUNCATED 2
#define FC_SATURATED 3
#define FC_TABLE 4

static int64_t answered(int64_t upper, int64_t lower)
{
#if FC_HELPER == FC_TIMES
    fc_gain gain;
    gain.mantissa = (fc_word)upper;
    gain.shift = FC_SHIFT;
    return fc_times(gain, lower);
#elif FC_HELPER == FC_ROUNDED
    return fc_rounded((upper * 65536) + lower, FC_SHIFT);
#elif FC_HELPER == FC_TRUNCATED
    return fc_truncated((upper * 65536) + lower, FC_SHIFT);
#elif FC_HELPER == FC_SATURATED
    return fc_saturated(upper, (lower < 0) ? -lower : lower);
#else
    return fc_table_at(&fc_controller.lifts[FC_SHIFT].table, (upper * 65536) + lower);
#endif
}

int main(void)
{
    uint64_t digest = 0xcbf29ce484222325ULL;
    int64_t upper;
    int64_t lower;
    for (upper = FC_FIRST; upper < FC_LAST; upper++) {
        for (lower = INT16_MIN; lower <= INT16_MAX; lower++) {
            digest = (digest ^ (uint64_t)answered(upper, lower)) * 0x100000001b3ULL;
        }
    }
    return (digest == FC_EXPECTED) ? 0 : 1;
}
