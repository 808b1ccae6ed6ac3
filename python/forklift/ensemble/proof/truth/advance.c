/* Steps of each recording's own length until its span is over, with the step of `solver.py` that stands above.

   y, u, T, k, span, next, spent: a row or a number a recording; k of the recording `column` says. y, next and
   spent are mended. 0, or 1 where a step gets shorter than `shortest`, 2 where more than `most` are spent. */
int truth_advance(long long recordings, const long long *column, double *y, const double *u, const double *T,
                  const double *k, const double *span, double *next, long long *spent, double tolerance,
                  double shortest, long long most)
{
    const double *arg[SZ_ARG];
    double *res[SZ_RES];
    casadi_int iw[SZ_IW];
    double w[SZ_W], after[STATES], parts[STATES];
    for (long long n = 0; n < recordings; n++) {
        double *own = y + n * STATES, left = span[n], h = next[n];
        while (left > 0.0) {
            int ends = h >= left * (1.0 - 1e-9);
            double tried = ends ? left : h;
            arg[0] = own, arg[1] = &tried, arg[2] = u + 2 * n, arg[3] = T + n, arg[4] = k + column[n] * VALUES;
            res[0] = after, res[1] = parts;
            truth_step(arg, res, iw, w, 0);
            double error = 0.0;
            for (int s = 0; s < STATES; s++)
                error = isfinite(parts[s]) ? fmax(error, fabs(parts[s])) : INFINITY;
            int good = error <= tolerance;
            if (!good && tried < shortest)
                return 1;
            if (++spent[n] > most)
                return 2;
            double factor = error > 0.0 ? SAFETY * pow(tolerance / error, 1.0 / ORDER) : GROW;
            factor = isfinite(error) ? fmin(fmax(factor, SHRINK), GROW) : SHRINK;
            /* A step cut short by its end says that a longer one is possible, not which. */
            h = good && ends ? fmax(h, tried * factor) : tried * factor;
            if (good) {
                for (int s = 0; s < STATES; s++)
                    own[s] = after[s];
                left = ends ? 0.0 : left - tried;
            }
        }
        next[n] = h;
    }
    return 0;
}
