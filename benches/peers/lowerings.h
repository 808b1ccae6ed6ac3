/* The two files a peer reads and writes; all numbers little-endian, 8 bytes each.
 *
 * lowerings:     int64 n, int64 ticks, float64 tick [s]; then n times:
 *                float64 load [kg], temperature [degC], command[ticks] [A], each held for one tick.
 * trajectories:  int64 n, int64 points (= ticks + 1), float64 seconds (processor time of one core for
 *                the integration of all n, without files); then n times points times
 *                4 float64: x [m], v [m/s], p_A [Pa], p_B [Pa]. */
#ifndef LOWERINGS_H
#define LOWERINGS_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct {
    int64_t n, ticks;
    double tick, *rows, *out;
} lowerings;

static inline void need(int ok, const char *what)
{
    if (!ok) {
        fprintf(stderr, "failed: %s\n", what);
        exit(1);
    }
}

static inline lowerings lowerings_read(const char *path)
{
    lowerings l;
    FILE *f = fopen(path, "rb");
    need(f && fread(&l.n, 8, 1, f) == 1 && fread(&l.ticks, 8, 1, f) == 1 && fread(&l.tick, 8, 1, f) == 1, path);
    const size_t count = (size_t)(l.n * (l.ticks + 2));
    l.rows = malloc(count * 8);
    l.out = calloc((size_t)(l.n * (l.ticks + 1) * 4), 8);
    need(l.rows && l.out && fread(l.rows, 8, count, f) == count, path);
    fclose(f);
    return l;
}

static inline void trajectories_write(const lowerings *l, double seconds, const char *path)
{
    const int64_t points = l->ticks + 1;
    const size_t count = (size_t)(l->n * points * 4);
    FILE *f = fopen(path, "wb");
    need(f && fwrite(&l->n, 8, 1, f) == 1 && fwrite(&points, 8, 1, f) == 1 && fwrite(&seconds, 8, 1, f) == 1, path);
    need(fwrite(l->out, 8, count, f) == count && fclose(f) == 0, path);
}

static inline double *point(const lowerings *l, int64_t lowering, int64_t tick)
{
    return l->out + (lowering * (l->ticks + 1) + tick) * 4;
}

/* The value of `name=value` among the arguments, or a default. */
static inline double option(int argc, char **argv, const char *name, double otherwise)
{
    for (int i = 1; i < argc; i++) {
        const size_t length = strlen(name);
        if (!strncmp(argv[i], name, length) && argv[i][length] == '=') return atof(argv[i] + length + 1);
    }
    return otherwise;
}

/* Processor time of this process [s]: unlike the wall's, it does not count waiting for a busy core. */
static inline double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#endif
