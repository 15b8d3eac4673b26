/* The exact model: textbook plays with a state each, in 113-bit arithmetic, from the numbers of the parameter file.

   Shares nothing with the package: written from the model's equations alone, without corner lists, prefix sums or
   analytic inverse weights. Feeds a compiled module with calls that lie on its kinks and limits, follows it, and
   compares every answer with the exact one and every error with the bound that the module's header states.

   Forward: exact output for the same drives. Inverse, twice: `sent` remembers the drives that the module really sent
   and answers once from there; `own` remembers its own exact drives and never sees a rounded one. */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if LDBL_MANT_DIG == 113
typedef long double quad;
#define quad_tanh tanhl
#define quad_atanh atanhl
#else
#include <quadmath.h>
typedef __float128 quad;
#define quad_tanh tanhq
#define quad_atanh atanhq
#endif

enum { MOST_STAGES = 16 };
enum { INPUT_CLAMPED = 1, OUTPUT_CLAMPED = 2, HELD = 4, DOMAIN_LIMITED = 8 };

/* ------------------------------------------------------------------ numbers of the model */

typedef struct {
    const oracle_model_t *m;
    const oracle_probe_t *p;
    quad low, high, offset;
    quad end[2][MOST_STAGES + 1][2]; /* range of every stage's input, by branch (1: ascending); the last: of the plays */
    quad *knot[2][MOST_STAGES], *value[2][MOST_STAGES]; /* of dead zones: ends and breaks of the range, values there */
    int knots[2][MOST_STAGES];
    quad steepest; /* bound of the slope of the memoryless part */
    bool branches;
    quad *start; /* n + 1 admissible states, entry 0 the input of the plays */
    quad start_drive, zero_drive;
    quad least, most; /* extremes of the output over every drive history */
    /* What drives and references are limited to. With one branch the exact ends. With two, where a limited value and
       the next one differ by less than the type can tell apart, the exact model would move where the module stands
       still, on the other branch: the ends there are the numbers in the header. */
    quad drive_end[2], reference_end[2];
    quad size;        /* nothing added up for an output exceeds it */
    quad outer;       /* sum of the weights, the steepest slope of the plays */
} context_t;

static quad least_of(quad a, quad b) { return a < b ? a : b; }
static quad most_of(quad a, quad b) { return a > b ? a : b; }
static quad clip(quad x, quad low, quad high) { return most_of(low, least_of(high, x)); }
static quad size_of(quad x) { return x < 0 ? -x : x; }

/* Value of a stage. */
static quad stage_value(const oracle_stage_t *s, quad x, bool up)
{
    quad y = 0;
    if (s->count == 0) {
        const double *a = s->a + (up ? 0 : 4);
        return (quad)a[0] * quad_tanh((quad)a[1] * x + a[2]) + a[3];
    }
    for (int j = 0; j < s->count; ++j) {
        const quad rho = s->threshold[j];
        y += (quad)s->weight[j] * (rho > 0 ? most_of(x - rho, 0) : rho < 0 ? least_of(x - rho, 0) : x);
    }
    return y;
}

/* w = G[v] on one branch. */
static quad front(const context_t *c, quad v, bool up)
{
    for (int j = 0; j < c->m->stages; ++j) {
        v = stage_value(&c->m->stage[j], v, up);
    }
    return v;
}

/* v = G^-1[w] for stages up to `last`, w inside what the range of the drive leads to. */
static quad back_through(const context_t *c, quad w, bool up, int last)
{
    for (int j = last; j >= 0; --j) {
        const oracle_stage_t *s = &c->m->stage[j];
        const quad *ends = c->end[up][j];
        if (s->count == 0) {
            const double *a = s->a + (up ? 0 : 4);
            const quad x = (w - a[3]) / a[0];
            w = x <= -1 || x >= 1 ? ((x > 0) == (a[1] > 0) ? ends[1] : ends[0]) : (quad_atanh(x) - a[2]) / a[1];
        } else {
            const quad *x = c->knot[up][j], *y = c->value[up][j];
            int i = 1;
            while (i < c->knots[up][j] - 1 && w > y[i]) {
                ++i;
            }
            w = x[i - 1] + (w - y[i - 1]) * (x[i] - x[i - 1]) / (y[i] - y[i - 1]);
        }
        w = clip(w, ends[0], ends[1]);
    }
    return w;
}

/* The same for any w: infinite beyond the range. */
static quad front_inverse(const context_t *c, quad w, bool up)
{
    const quad *ends = c->end[up][c->m->stages];
    if (c->m->stages == 0) {
        return w;
    }
    if (w > ends[1] || w < ends[0]) {
        return w > ends[1] ? (quad)INFINITY : -(quad)INFINITY;
    }
    return back_through(c, w, up, c->m->stages - 1);
}

static quad drive_inside(const context_t *c, quad v) { return clip(v, c->drive_end[0], c->drive_end[1]); }

/* ------------------------------------------------------------------ memory */

typedef struct {
    quad *s; /* n + 1 states: the input of the plays, then every play */
    quad applied, pending, answer, level;
    double reference;
    bool ascending, has_pending, stepped, repeat;
    bool moved; /* since init or reset */
} exact_t;

static quad play(quad s, quad w, quad r) { return most_of(w - r, least_of(w + r, s)); }

/* Output of the play sum if its input went to w. */
static quad output_at(const context_t *c, const exact_t *e, quad w)
{
    quad y = (quad)c->m->weight[0] * w;
    for (int i = 1; i <= c->m->n; ++i) {
        y += (quad)c->m->weight[i] * play(e->s[i], w, c->m->threshold[i]);
    }
    return y;
}

static void absorb_w(const context_t *c, exact_t *e, quad w)
{
    for (int i = 1; i <= c->m->n; ++i) {
        e->s[i] = play(e->s[i], w, c->m->threshold[i]);
    }
    e->s[0] = w;
}

/* The actuator has seen drive v; its own move picks the branch, an unmoved drive keeps it. */
static void absorb(const context_t *c, exact_t *e, quad v)
{
    if (v > e->applied) {
        e->ascending = true;
    } else if (v < e->applied) {
        e->ascending = false;
    }
    e->moved = e->moved || v != e->applied;
    e->applied = v;
    absorb_w(c, e, front(c, v, e->ascending));
}

static bool unsolved; /* the oracle's own check of `solve` */

/* Input of the plays that makes the play sum y. The sum rises with it, straight between places where a play begins to
   follow: s_i + r_i upward, s_i - r_i downward, in the order of i because the memory is admissible. */
static quad solve(const context_t *c, const exact_t *e, quad y)
{
    const oracle_model_t *m = c->m;
    quad w = e->s[0], at = output_at(c, e, w), slope = m->weight[0];
    const int way = y >= at ? 1 : -1;
    quad limit = way * (quad)INFINITY; /* the next such place, which a flat piece would pass by rounding */
    for (int i = 1; i <= m->n; ++i) {
        const quad turn = e->s[i] + way * (quad)m->threshold[i];
        if (way > 0 ? turn > w : turn < w) {
            const quad there = at + slope * (turn - w);
            if (way > 0 ? there >= y : there <= y) {
                limit = turn;
                break;
            }
            at = there;
            w = turn;
        }
        slope += m->weight[i];
    }
    w += (y - at) / slope;
    w = way > 0 ? least_of(w, limit) : most_of(w, limit);
    unsolved = unsolved || !(size_of(output_at(c, e, w) - y) <= (quad)1e-28 * (c->size + size_of(y)));
    return w;
}

static void begin(const context_t *c, exact_t *e, bool zero)
{
    for (int i = 0; i <= c->m->n; ++i) {
        e->s[i] = zero ? 0 : c->start[i];
    }
    e->applied = e->pending = e->answer = zero ? c->zero_drive : c->start_drive;
    e->level = output_at(c, e, e->s[0]) + c->offset;
    e->ascending = true;
    e->has_pending = e->stepped = e->repeat = e->moved = false;
    e->reference = 0;
}

static void take_pending(const context_t *c, exact_t *e)
{
    if (e->has_pending) {
        absorb(c, e, e->pending);
        e->has_pending = false;
    }
}

static void commit(const context_t *c, exact_t *e, quad v)
{
    e->pending = drive_inside(c, v);
    e->has_pending = true;
    e->repeat = false;
}

/* Whether going to v is a move of the branch that v was computed on. */
static bool fits(const context_t *c, const exact_t *e, quad v, bool up)
{
    v = drive_inside(c, v);
    return v > e->applied ? up : v < e->applied ? !up : e->ascending == up;
}

/* The drive for the reference `asked` (finite), pending drives absorbed before; the input of the plays and the branch
   that it was solved for to `at` and `branch`. */
static quad exact_answer(const context_t *c, exact_t *e, double asked, quad *at, bool *branch)
{
    const quad u = clip(c->p->kind == ORACLE_FIXED ? asked * (quad)c->p->output_lsb : asked,
        c->reference_end[0], c->reference_end[1]);
    const quad w = *at = solve(c, e, u - c->offset);
    bool up = true;
    quad v = front_inverse(c, w, true);
    if (c->branches) {
        up = u > e->level ? true : u < e->level ? false : e->ascending;
        v = front_inverse(c, w, up);
        if (!fits(c, e, v, up)) {
            up = !up;
            v = front_inverse(c, w, up);
            if (!fits(c, e, v, up)) {
                v = e->applied;
                up = e->ascending;
            }
        }
    }
    *branch = up;
    e->level = u;
    return drive_inside(c, v);
}

/* One sample of the exact inverse. */
static quad exact_step(const context_t *c, exact_t *e, double asked, quad *at, bool *branch)
{
    *at = 0;
    *branch = e->ascending;
    take_pending(c, e);
    if (!isfinite(asked)) {
        e->answer = drive_inside(c, e->stepped ? e->answer : e->applied);
    } else if (!(e->repeat && asked == e->reference)) {
        e->answer = exact_answer(c, e, asked, at, branch);
        e->reference = asked;
        e->repeat = true;
    }
    e->stepped = true;
    e->pending = e->answer;
    e->has_pending = true;
    return e->answer;
}

/* ------------------------------------------------------------------ set up */

static void stage_ranges(context_t *c)
{
    c->steepest = 1;
    for (int j = 0; j < c->m->stages; ++j) {
        const oracle_stage_t *s = &c->m->stage[j];
        quad steep = 0;
        for (int up = 0; up < 2; ++up) {
            quad *ends = c->end[up][j], *after = c->end[up][j + 1];
            if (j == 0) {
                ends[0] = c->low;
                ends[1] = c->high;
            }
            if (s->count == 0) {
                after[0] = stage_value(s, ends[0], up);
                after[1] = stage_value(s, ends[1], up);
                steep = most_of(steep, (quad)s->a[up ? 0 : 4] * s->a[up ? 1 : 5]);
            } else {
                quad *x = c->knot[up][j] = malloc((size_t)(s->count + 2) * sizeof(quad));
                quad *y = c->value[up][j] = malloc((size_t)(s->count + 2) * sizeof(quad));
                int k = 0;
                x[k++] = ends[0];
                for (int i = 0; i < s->count; ++i) {
                    if (s->threshold[i] != 0 && s->threshold[i] > ends[0] && s->threshold[i] < ends[1]) {
                        x[k++] = s->threshold[i];
                    }
                }
                x[k++] = ends[1];
                after[0] = (quad)INFINITY;
                after[1] = -(quad)INFINITY;
                for (int i = 0; i < k; ++i) {
                    y[i] = stage_value(s, x[i], up);
                    after[0] = least_of(after[0], y[i]);
                    after[1] = most_of(after[1], y[i]);
                    if (i > 0) {
                        steep = most_of(steep, size_of((y[i] - y[i - 1]) / (x[i] - x[i - 1])));
                    }
                }
                c->knots[up][j] = k;
            }
        }
        c->branches = c->branches || (s->count == 0 && memcmp(s->a, s->a + 4, 4 * sizeof(double)) != 0);
        c->steepest *= steep;
    }
    if (c->m->stages == 0) {
        for (int up = 0; up < 2; ++up) {
            c->end[up][0][0] = c->low;
            c->end[up][0][1] = c->high;
        }
    }
}

static void set_up(context_t *c, const oracle_model_t *m, const oracle_probe_t *p)
{
    quad ends[2], total = 0;
    exact_t e;
    memset(c, 0, sizeof *c);
    c->m = m;
    c->p = p;
    c->low = m->low;
    c->high = m->high;
    c->offset = m->offset;
    stage_ranges(c);
    c->start = malloc((size_t)(m->n + 1) * sizeof(quad));
    for (int i = 1; i <= m->n; ++i) { /* the memory nearest to the one asked for that a history can leave */
        const quad asked = m->listed ? m->start[i] : m->start[0];
        const quad reach = (quad)m->threshold[i] - m->threshold[i - 1];
        c->start[i] = i == 1 || !m->listed ? asked : clip(asked, c->start[i - 1] - reach, c->start[i - 1] + reach);
    }
    c->start[0] = m->n > 0 ? c->start[1] : m->start[0];
    if (p->inverse_size > 0 || c->branches) {
        c->start_drive = front_inverse(c, c->start[0], true);
        c->zero_drive = front_inverse(c, 0, true);
    }
    for (int i = 0; i < 2; ++i) {
        quad a = c->end[0][m->stages][i], b = c->end[1][m->stages][i];
        ends[i] = i == 0 ? least_of(a, b) : most_of(a, b);
    }
    e.s = c->start;
    c->least = output_at(c, &e, ends[0]) + c->offset;
    c->most = output_at(c, &e, ends[1]) + c->offset;
    c->size = size_of(c->offset);
    for (int i = 0; i <= m->n; ++i) {
        total += m->weight[i];
        c->size += (quad)m->weight[i] * m->threshold[i];
    }
    c->outer = total;
    c->size += total * most_of(most_of(size_of(ends[0]), size_of(ends[1])), size_of(c->start[0]));
}

static quad physical(const context_t *c, double x, double lsb)
{
    return c->p->kind == ORACLE_FIXED ? (quad)x * lsb : x;
}

static void set_limits(context_t *c)
{
    const oracle_probe_t *p = c->p;
    c->drive_end[0] = c->branches ? physical(c, p->drive_min, p->drive_lsb) : c->low;
    c->drive_end[1] = c->branches ? physical(c, p->drive_max, p->drive_lsb) : c->high;
    c->reference_end[0] = c->branches ? physical(c, p->output_min, p->output_lsb) : c->least;
    c->reference_end[1] = c->branches ? physical(c, p->output_max, p->output_lsb) : c->most;
}

static void tear_down(context_t *c)
{
    for (int up = 0; up < 2; ++up) {
        for (int j = 0; j < c->m->stages; ++j) {
            free(c->knot[up][j]);
            free(c->value[up][j]);
        }
    }
    free(c->start);
}

/* ------------------------------------------------------------------ numbers of the type */

static double rounded(const context_t *c, double x)
{
    if (c->p->kind == ORACLE_F32) {
        return (double)(float)x;
    }
    return c->p->kind == ORACLE_F64 ? x : fmin(fmax(nearbyint(x), -2147483648.0), 2147483647.0);
}

static double neighbour(const context_t *c, double x, int by)
{
    for (int i = 0; i < abs(by); ++i) {
        x = c->p->kind == ORACLE_F32 ? (double)nextafterf((float)x, by > 0 ? INFINITY : -INFINITY)
            : c->p->kind == ORACLE_F64 ? nextafter(x, by > 0 ? INFINITY : -INFINITY) : x + (by > 0 ? 1 : -1);
    }
    return x;
}

static double coded(const context_t *c, quad x, double lsb)
{
    return rounded(c, (double)(c->p->kind == ORACLE_FIXED ? x / lsb : x));
}

/* ------------------------------------------------------------------ calls that ask where it hurts */

enum { KEPT = 32 };

typedef struct {
    context_t c;
    uint64_t random;
    double drive[KEPT], reference[KEPT]; /* asked for earlier */
    double last;                         /* drive or reference asked for last */
    int regime, left;
    double from, to, size;
    int steps, step;
    bool codes15;
} feed_t;

static uint64_t random_bits(feed_t *f)
{
    f->random ^= f->random << 13;
    f->random ^= f->random >> 7;
    f->random ^= f->random << 17;
    return f->random * UINT64_C(0x2545F4914F6CDD1D) >> 11;
}

static double uniform(feed_t *f, double low, double high)
{
    return low + (high - low) * (double)random_bits(f) / 9007199254740992.0;
}

static int choice(feed_t *f, int n) { return (int)(random_bits(f) % (uint64_t)n); }

static int few(feed_t *f) { return choice(f, 3) - 1 + (choice(f, 8) == 0 ? choice(f, 9) - 4 : 0); }

/* Beyond a range by up to a thousand times its length. */
static double far_out(feed_t *f, double low, double high)
{
    const double by = (high - low) * pow(10, uniform(f, -3, 3));
    return rounded(&f->c, choice(f, 2) ? high + by : low - by);
}

/* A value of the inputs of the plays at which some play begins to follow, or would after a turn. */
static quad kink(feed_t *f, const exact_t *e)
{
    const oracle_model_t *m = f->c.m;
    const int i = m->n > 0 ? 1 + choice(f, m->n) : 0;
    const quad r = m->threshold[i], way = choice(f, 2) ? 1 : -1;
    switch (choice(f, 5)) {
    case 0: return e->s[0] + way * 2 * r;
    case 1: return e->s[i];
    case 2: return way * r;
    default: return e->s[i] + way * r;
    }
}

/* Any value that a drive of the type can have: near kinks, limits, breaks and earlier values of memory e. */
static double some_drive(feed_t *f, const exact_t *e)
{
    const context_t *c = &f->c;
    const oracle_probe_t *p = c->p;
    const double low = p->drive_min, high = p->drive_max, lsb = p->drive_lsb;
    const bool up = c->branches ? choice(f, 2) == 1 : true;
    double x;
    switch (choice(f, 16)) {
    case 0: case 1: case 2:
        return rounded(c, uniform(f, low, high));
    case 3: case 4: case 5: case 6: {
        if (c->m->stages > 0 && p->inverse_size == 0) {
            return rounded(c, uniform(f, low, high));
        }
        x = coded(c, drive_inside(c, front_inverse(c, kink(f, e), up)), lsb);
        return neighbour(c, x, few(f));
    }
    case 7:
        return neighbour(c, choice(f, 2) ? low : high, few(f));
    case 8: case 9:
        return f->drive[choice(f, KEPT)];
    case 10:
        return neighbour(c, f->drive[0], few(f));
    case 11:
        return rounded(c, f->drive[0] + (choice(f, 2) ? 1 : -1) * (high - low) * pow(10, uniform(f, -9, 0)));
    case 12: {
        const int j = c->m->stages > 0 ? choice(f, c->m->stages) : -1;
        if (j < 0 || c->m->stage[j].count == 0 || (j > 0 && p->inverse_size == 0)) {
            return rounded(c, uniform(f, low, high));
        }
        x = coded(c, back_through(c, c->knot[up][j][choice(f, c->knots[up][j])], up, j - 1), lsb);
        return neighbour(c, x, few(f));
    }
    case 13:
        return choice(f, 3) ? rounded(c, uniform(f, low, high)) : far_out(f, low, high);
    case 14:
        return 0;
    default:
        return neighbour(c, coded(c, drive_inside(c, c->start_drive), lsb), few(f));
    }
}

/* Any reference: where such drives lead, limits, earlier ones. Pending drives of e are absorbed. */
static double some_reference(feed_t *f, const exact_t *e)
{
    const context_t *c = &f->c;
    const oracle_probe_t *p = c->p;
    const double low = p->output_min, high = p->output_max, lsb = p->output_lsb;
    double x;
    switch (choice(f, 16)) {
    case 0: case 1: case 2:
        return rounded(c, uniform(f, low, high));
    case 3: case 4: case 5: case 6:
        return neighbour(c, coded(c, output_at(c, e, kink(f, e)) + c->offset, lsb), few(f));
    case 7: {
        const quad v = physical(c, some_drive(f, e), p->drive_lsb);
        x = coded(c, output_at(c, e, front(c, drive_inside(c, v), choice(f, 2))) + c->offset, lsb);
        return neighbour(c, x, few(f));
    }
    case 8:
        return neighbour(c, choice(f, 2) ? low : high, few(f));
    case 9: case 10:
        return f->reference[choice(f, KEPT)];
    case 11:
        return neighbour(c, f->reference[0], few(f));
    case 12:
        return rounded(c, f->reference[0] + (choice(f, 2) ? 1 : -1) * (high - low) * pow(10, uniform(f, -9, 0)));
    case 13:
        return choice(f, 3) ? rounded(c, uniform(f, low, high)) : far_out(f, low, high);
    case 14: { /* what the limits of the drive give now */
        const bool up = choice(f, 2) == 1;
        const quad w = front(c, up ? c->high : c->low, c->branches ? choice(f, 2) == 1 : true);
        return neighbour(c, coded(c, output_at(c, e, w) + c->offset, lsb), few(f));
    }
    default:
        return neighbour(c, coded(c, output_at(c, e, e->s[0]) + c->offset, lsb), few(f));
    }
}

static double some(feed_t *f, const exact_t *e, bool inverse)
{
    return inverse ? some_reference(f, e) : some_drive(f, e);
}

/* The next sample: stretches of scattered values, ramps, plateaus, loops and walks. */
static double next_sample(feed_t *f, const exact_t *e, bool inverse)
{
    const context_t *c = &f->c;
    const double low = inverse ? c->p->output_min : c->p->drive_min;
    const double high = inverse ? c->p->output_max : c->p->drive_max;
    double x;
    if (f->left-- <= 0) {
        f->left = 4 + choice(f, 40);
        f->regime = choice(f, 8);
        f->from = f->last;
        f->to = some(f, e, inverse);
        f->steps = 1 + choice(f, 30);
        f->step = 0;
        f->size = (high - low) * pow(10, uniform(f, -8, -0.5));
    }
    switch (f->regime) {
    case 0: /* a ramp, straight or to the next codes */
        f->step += f->step < f->steps;
        x = f->step == f->steps ? f->to : rounded(c, f->from + (f->to - f->from) * f->step / f->steps);
        break;
    case 1: /* a plateau with single turns */
        x = choice(f, 4) ? f->last : some(f, e, inverse);
        break;
    case 2: /* loops that shrink */
        f->step++;
        x = rounded(c, f->to + (f->step % 2 ? 1 : -1) * f->size * 8 * pow(0.8, f->step));
        break;
    case 3: /* a walk */
        x = rounded(c, f->last + uniform(f, -f->size, f->size));
        if (!(x >= low && x <= high)) {
            x = rounded(c, uniform(f, low, high));
        }
        break;
    case 4: /* by last bits */
        x = neighbour(c, f->last, few(f));
        break;
    default:
        x = some(f, e, inverse);
    }
    if (c->p->kind != ORACLE_FIXED && choice(f, 60) == 0) {
        static const double odd[] = {NAN, INFINITY, -INFINITY, 3e38, -3e38, 1e-45, -0.0};
        x = odd[choice(f, 7)];
    } else if (c->p->kind == ORACLE_FIXED) {
        const double most = f->codes15 ? 32767 : 2147483647;
        x = choice(f, 200) == 0 ? (choice(f, 2) ? most : -most - 1) : fmin(fmax(x, -most - 1), most);
    }
    return x;
}

static void keep(feed_t *f, double x, bool inverse)
{
    if (isfinite(x) && fabs(x) < 1e38) {
        double *kept = inverse ? f->reference : f->drive;
        const double low = inverse ? f->c.p->output_min : f->c.p->drive_min;
        const double high = inverse ? f->c.p->output_max : f->c.p->drive_max;
        memmove(kept + 1, kept, (KEPT - 1) * sizeof(double));
        kept[0] = x;
        f->last = fmin(fmax(x, low), high);
    }
}

/* ------------------------------------------------------------------ comparison */

static void fault(oracle_result_t *r, long call, const char *format, ...)
{
    va_list arguments;
    if (r->first >= 0) {
        return;
    }
    r->first = call;
    va_start(arguments, format);
    vsnprintf(r->message, sizeof r->message, format, arguments);
    va_end(arguments);
}

/* Error over bound: counts and keeps the largest. */
static void judge(oracle_result_t *r, long call, const char *what, quad answer, quad exact, double bound, long *over,
    double *worst)
{
    const double error = (double)size_of(answer - exact), ratio = error / bound;
    if (!(ratio <= *worst)) {
        *worst = ratio;
    }
    if (!(error <= bound)) {
        ++*over;
        fault(r, call, "%s: answer %.17g, exact %.17g, error %.6g is %.6g times the bound %.6g", what, (double)answer,
            (double)exact, error, ratio, bound);
    }
}

static void bits_are(oracle_result_t *r, long call, unsigned status, unsigned bit, bool must, bool may, const char *what)
{
    const bool set = (status & bit) != 0;
    if ((must && !set) || (set && !may)) {
        ++r->wrong;
        fault(r, call, "status bit %s is %sset", what, set ? "" : "not ");
    }
}

/* Macros of the header: the range and the extremes, rounded inward. */
static void check_limits(const context_t *c, oracle_result_t *r)
{
    const oracle_probe_t *p = c->p;
    const double text = 1 + 4 * DBL_EPSILON; /* the LSB is printed as a double */
    /* the package finds extremes in double, where a stage may cancel most of its argument */
    const quad drive = most_of(size_of(c->low), size_of(c->high));
    const quad slack = 64 * (quad)DBL_EPSILON * (c->size + c->outer * c->steepest * drive);
    const struct { const char *name; double value, lsb; quad end; int inward; quad off; } rows[] = {
        {"DRIVE_MIN", p->drive_min, p->drive_lsb, c->low, 1, size_of(c->low) * (text - 1)},
        {"DRIVE_MAX", p->drive_max, p->drive_lsb, c->high, -1, size_of(c->high) * (text - 1)},
        {"OUTPUT_MIN", p->output_min, p->output_lsb, c->least, 1, slack},
        {"OUTPUT_MAX", p->output_max, p->output_lsb, c->most, -1, slack},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; ++i) {
        const quad inside = (physical(c, rows[i].value, rows[i].lsb) - rows[i].end) * rows[i].inward;
        const quad next = (physical(c, neighbour(c, rows[i].value, -rows[i].inward), rows[i].lsb) - rows[i].end)
            * rows[i].inward;
        const quad off = p->kind == ORACLE_FIXED || i >= 2 ? rows[i].off : 0;
        const bool sharp = off < (quad)1e-6 * (inside - next); /* than a step of the type */
        if (!(inside >= -off && (sharp ? next < -off : next <= off))) {
            ++r->wrong;
            fault(r, 0, "%s is %.17g, the exact end %.17g", rows[i].name, (double)physical(c, rows[i].value, rows[i].lsb),
                (double)rows[i].end);
        }
    }
}

static void prepare(feed_t *f, const oracle_model_t *m, const oracle_probe_t *p, uint64_t seed, oracle_result_t *r)
{
    memset(f, 0, sizeof *f);
    memset(r, 0, sizeof *r);
    r->first = -1;
    set_up(&f->c, m, p);
    set_limits(&f->c);
    f->random = seed * UINT64_C(0x9E3779B97F4A7C15) + 0x1234567;
    f->codes15 = p->kind == ORACLE_FIXED && fmax(fabs(p->drive_max), fabs(p->drive_min)) < 32768
        && fmax(fabs(p->output_max), fabs(p->output_min)) < 32768;
    for (int i = 0; i < KEPT; ++i) {
        f->drive[i] = rounded(&f->c, uniform(f, p->drive_min, p->drive_max));
        f->reference[i] = rounded(&f->c, uniform(f, p->output_min, p->output_max));
    }
    check_limits(&f->c, r);
    unsolved = false;
}

static exact_t memory(const context_t *c)
{
    exact_t e;
    memset(&e, 0, sizeof e);
    e.s = malloc((size_t)(c->m->n + 1) * sizeof(quad));
    begin(c, &e, false);
    return e;
}

/* Whether v is so near to the drive a start memory stands for that rounding decides whether and where it moves. */
static bool uncertain_start(const context_t *c, const exact_t *e, quad v, quad near)
{
    return c->branches && !e->moved && size_of(drive_inside(c, v) - e->applied) <= near;
}

/* The inverse starts at a number of its type, where it may stay. */
static quad about_a_number(const context_t *c)
{
    return (c->high - c->low) / 1000 + 4 * physical(c, 1, c->p->drive_lsb) * (c->p->kind == ORACLE_FIXED);
}

/* The forward operator knows the start drive as it is, to double precision. */
static quad about_a_double(const context_t *c) { return (c->high - c->low) / 1000000000; }

void oracle_forward(const oracle_model_t *m, const oracle_probe_t *p, uint64_t seed, long calls, double shrink,
    oracle_call_t *log, oracle_result_t *r)
{
    feed_t f;
    exact_t e;
    void *self = malloc(p->forward_size);
    quad exact;
    prepare(&f, m, p, seed, r);
    e = memory(&f.c);
    p->forward_init(self);
    exact = output_at(&f.c, &e, e.s[0]) + f.c.offset;
    for (long k = 0; k < calls; ++k) {
        const int what = choice(&f, 120);
        const int call = what == 0 ? ORACLE_INIT : what <= 2 ? ORACLE_RESET : ORACLE_STEP;
        double x, answer = 0;
        unsigned status;
        if (call != ORACLE_STEP) {
            p->forward_init(self);
            begin(&f.c, &e, call == ORACLE_RESET);
            exact = output_at(&f.c, &e, e.s[0]) + f.c.offset;
        }
        x = next_sample(&f, &e, false);
        if (f.c.branches && !e.moved && choice(&f, 2) == 0) { /* right beside the drive that the start memory stands for */
            x = neighbour(&f.c, coded(&f.c, drive_inside(&f.c, e.applied), p->drive_lsb), choice(&f, 3) - 1);
            x = p->kind == ORACLE_FIXED ? fmin(fmax(x, p->drive_min), p->drive_max) : x;
        }
        if (call != ORACLE_INIT && isfinite(x)
            && uncertain_start(&f.c, &e, physical(&f.c, x, p->drive_lsb), about_a_double(&f.c))) {
            x = p->drive_min + p->drive_max - x;
            if (uncertain_start(&f.c, &e, physical(&f.c, x, p->drive_lsb), about_a_double(&f.c))) {
                x = p->drive_min;
            }
        }
        x = rounded(&f.c, x);
        if (call == ORACLE_RESET) {
            p->forward_reset(self, x);
        } else if (call == ORACLE_STEP) {
            answer = p->forward_step(self, x);
        }
        status = p->forward_status(self);
        if (log) {
            log[k] = (oracle_call_t){call, x, answer};
        }
        ++r->samples;
        if (call == ORACLE_INIT) {
            bits_are(r, k, status, 15, false, false, "any, behind init");
            continue;
        }
        if (isfinite(x)) {
            absorb(&f.c, &e, drive_inside(&f.c, physical(&f.c, x, p->drive_lsb)));
            exact = output_at(&f.c, &e, e.s[0]) + f.c.offset;
            keep(&f, x, false);
        }
        bits_are(r, k, status, HELD, !isfinite(x), !isfinite(x), "HELD");
        {
            const bool out = isfinite(x) && (x < p->drive_min || x > p->drive_max);
            bits_are(r, k, status, INPUT_CLAMPED, out, out, "INPUT_CLAMPED");
        }
        bits_are(r, k, status, DOMAIN_LIMITED, false, false, "DOMAIN");
        {
            /* behind a reset the output can be more than any code: then it is the last code, and a bit says so */
            const double most = p->kind == ORACLE_FIXED ? (f.codes15 ? 32767 : 2147483647) : HUGE_VAL;
            const quad size = size_of(exact) / p->output_lsb;
            const bool may = isfinite(x) && size >= most - p->forward_bound;
            bits_are(r, k, status, OUTPUT_CLAMPED, isfinite(x) && size > most + p->forward_bound, may, "OUTPUT_CLAMPED");
            if (call == ORACLE_STEP && (status & OUTPUT_CLAMPED) != 0) {
                if (answer != (exact > 0 ? most : -most)) {
                    ++r->wrong;
                    fault(r, k, "a limited output is %.17g, not the last code", answer);
                }
                continue;
            }
        }
        if (call == ORACLE_STEP) {
            judge(r, k, "forward", answer * (quad)p->output_lsb, exact, p->forward_bound * p->output_lsb * shrink,
                &r->over_forward, &r->worst_forward);
        }
    }
    free(e.s);
    free(self);
    tear_down(&f.c);
}

void oracle_inverse(const oracle_model_t *m, const oracle_probe_t *p, uint64_t seed, long calls, double shrink,
    oracle_call_t *log, oracle_result_t *r)
{
    feed_t f;
    exact_t sent, own;
    const double bound = p->inverse_bound * p->drive_lsb * shrink;
    const double rounding = p->rounding_bound * p->drive_lsb * shrink;
    void *self = malloc(p->inverse_size);
    bool known = true;  /* which branch a drive so near to the start has moved on */
    bool often = false;
    bool agreed = true; /* `own` and the module have moved on the same branches */
    bool same = true, same_own = true; /* `sent`, `own` and the module have given the last answer on the same branch */
    prepare(&f, m, p, seed, r);
    sent = memory(&f.c);
    own = memory(&f.c);
    p->inverse_init(self);
    for (long k = 0; k < calls; ++k) {
        const context_t *c = &f.c;
        const int what = choice(&f, 120);
        const int commits = often ? 50 : 18; /* of 120, more behind a commit and a held step */
        const int call = what == 0 ? ORACLE_INIT : what <= 2 ? ORACLE_RESET : what < 3 + commits ? ORACLE_COMMIT
            : ORACLE_STEP;
        double x, answer = 0;
        unsigned status;
        quad at, exact, exact_own, ignored, v;
        bool up, up_own, fresh, moved_up;
        if (call == ORACLE_COMMIT) {
            x = rounded(c, choice(&f, 6) && isfinite((double)sent.pending)
                    ? neighbour(c, coded(c, sent.pending, p->drive_lsb), few(&f)) : some_drive(&f, &sent));
            if (p->kind != ORACLE_FIXED && choice(&f, 30) == 0) {
                x = choice(&f, 2) ? NAN : -INFINITY;
            } else if (p->kind == ORACLE_FIXED) {
                const double most = f.codes15 ? 32767 : 2147483647;
                x = fmin(fmax(x, -most - 1), most);
            }
            p->inverse_commit(self, x);
            status = p->inverse_status(self);
            if (log) {
                log[k] = (oracle_call_t){call, x, 0};
            }
            ++r->samples;
            bits_are(r, k, status, HELD, !isfinite(x), !isfinite(x), "HELD of commit");
            {
                const bool out = isfinite(x) && (x < p->drive_min || x > p->drive_max);
                bits_are(r, k, status, INPUT_CLAMPED, out, out, "INPUT_CLAMPED of commit");
            }
            if (isfinite(x)) {
                commit(c, &sent, physical(c, x, p->drive_lsb));
                commit(c, &own, physical(c, x, p->drive_lsb));
                keep(&f, x, false);
            }
            often = true;
            continue;
        }
        if (call != ORACLE_STEP) {
            begin(c, &sent, call == ORACLE_RESET);
            begin(c, &own, call == ORACLE_RESET);
            known = agreed = same = same_own = true;
        }
        if (sent.has_pending) {
            known = known && !uncertain_start(c, &sent, sent.pending, about_a_number(c));
            take_pending(c, &sent);
            take_pending(c, &own);
            agreed = agreed && known && sent.ascending == own.ascending;
        }
        x = next_sample(&f, &sent, true);
        often = !isfinite(x);
        if (call == ORACLE_INIT) {
            p->inverse_init(self);
        } else if (call == ORACLE_RESET) {
            p->inverse_reset(self, x);
        } else {
            answer = p->inverse_step(self, x);
        }
        status = p->inverse_status(self);
        ++r->samples;
        if (log) {
            log[k] = (oracle_call_t){call, x, answer};
        }
        if (call == ORACLE_INIT) {
            bits_are(r, k, status, 15, false, false, "any, behind init");
            continue;
        }
        fresh = isfinite(x) && !(sent.repeat && x == sent.reference);
        exact = exact_step(c, &sent, x, &at, &up);
        exact_own = exact_step(c, &own, x, &ignored, &up_own);
        if (call == ORACLE_RESET) { /* its drive is not returned; the same reference, or NaN, gets it again */
            answer = p->inverse_step(self, x);
            (void)p->inverse_status(self);
        }
        v = answer * (quad)p->drive_lsb;
        moved_up = v > sent.applied ? true : v < sent.applied ? false : sent.ascending;
        if (fresh) { /* else it is the last answer once more */
            same = known && !uncertain_start(c, &sent, v, about_a_number(c)) && moved_up == up;
            same_own = same && up == up_own;
        }
        sent.answer = sent.pending = v; /* what the actuator sees */
        if (call == ORACLE_RESET) {
            known = known && !uncertain_start(c, &sent, v, about_a_number(c));
            take_pending(c, &sent);
            take_pending(c, &own);
            sent.has_pending = own.has_pending = true;
        }
        keep(&f, x, true);

        if (!(answer >= p->drive_min && answer <= p->drive_max)) {
            ++r->wrong;
            fault(r, k, "drive %.17g is outside DRIVE_MIN .. DRIVE_MAX", answer);
        }
        bits_are(r, k, status, HELD, !isfinite(x), !isfinite(x), "HELD");
        {
            const bool out = isfinite(x) && (x < p->output_min || x > p->output_max);
            bits_are(r, k, status, INPUT_CLAMPED, out, out, "INPUT_CLAMPED");
        }
        if (fresh && (same || !c->branches)) {
            /* a bound that is the whole range says nothing of how far an answer can lie beyond it */
            const bool open = p->inverse_bound >= (p->drive_max - p->drive_min) * 0.999;
            const quad *ends = c->end[up][m->stages], room = open ? (quad)HUGE_VAL : c->steepest * bound;
            const bool must = at > ends[1] + room || at < ends[0] - room;
            const bool may = at >= ends[1] - room || at <= ends[0] + room;
            bits_are(r, k, status, OUTPUT_CLAMPED, must, may, "OUTPUT_CLAMPED");
            bits_are(r, k, status, DOMAIN_LIMITED, false, may, "DOMAIN");
        }
        judge(r, k, "inverse, memory as sent", v, exact, bound, &r->over_single, &r->worst_single);
        judge(r, k, "inverse, own memory", v, exact_own, bound, &r->over_own, &r->worst_own);
        if (c->branches && same) {
            judge(r, k, "inverse, memory as sent, same branch", v, exact, rounding, &r->over_same_branch,
                &r->worst_same_branch);
            if (agreed && same_own) {
                judge(r, k, "inverse, own memory, same branches", v, exact_own, rounding, &r->over_same_branch,
                    &r->worst_same_branch);
            }
        }
    }
    if (unsolved) {
        ++r->wrong;
        fault(r, calls - 1, "the oracle's own solution does not solve");
    }
    free(sent.s);
    free(own.s);
    free(self);
    tear_down(&f.c);
}
