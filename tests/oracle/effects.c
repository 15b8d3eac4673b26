/* An exact model with effects, in long double and by formulas of its own, that follows what an emitted module sends.

   Of the inverse it checks each answer twice: against the drive that is right for an actuator that has seen every drive
   as it was applied, and against a compensator that runs by itself. An amplifier with the limited rate follows the
   drives: no answer may run ahead of it by more than the last bit of the drive's range, or a code. */
#include "effects.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef long double real;

/* Of a place that millions of small steps lead to. */
#if defined(__SIZEOF_FLOAT128__)
typedef __float128 place;
#else
typedef long double place; /* 113 bits there */
#endif

enum { MOST_PLAYS = 32, MOST_CREEPS = 16, MOST_ELEMENTS = 3, MOST_LINE = 64, TURNS = 40, TRIES = 200 };
enum { OUTPUT_CLAMPED = 2, HELD = 4, SLEW_LIMITED = 16 };

/* Everything that an actuator remembers. */
typedef struct {
    bool moving;
    real w, play[MOST_PLAYS + 1], h; /* input of the plays, their states and sum */
    real element[MOST_ELEMENTS];     /* z/width */
    real creep[MOST_CREEPS];
    real travelled, applied; /* the drive as commanded */
    place at;                /* where the amplifier is */
    real lag, wanted, asked, meant;
    long tick;
} memory_t;

typedef struct {
    const effects_model_t *m;
    real e[MOST_CREEPS], early[MOST_CREEPS], late[MOST_CREEPS];
    place up, down;
    real temperature;
    real lag_kept, lag_early, lag_late;
} plant_t;

static void prepare(plant_t *p, const effects_model_t *m) {
    int i;
    memset(p, 0, sizeof *p);
    p->m = m;
    for (i = 0; i < m->creeps; ++i) {
        const real s = (real)m->seconds / (real)m->time_constant[i];
        const real gone = -expm1l(-s);
        p->e[i] = 1 - gone;
        p->late[i] = 1 - gone / s;
        p->early[i] = gone - p->late[i];
    }
    if (m->lag > 0) {
        const real s = (real)m->seconds / (real)m->lag;
        const real gone = -expm1l(-s);
        p->lag_kept = 1 - gone;
        p->lag_late = 1 - gone / s;
        p->lag_early = gone - p->lag_late;
    }
    p->up = (place)m->rising * (place)m->seconds;
    p->down = (place)m->falling * (place)m->seconds;
    p->temperature = (real)m->reference;
}

/* An actuator at rest in its start memory. */
static memory_t begun(const effects_model_t *m) {
    memory_t s = {0};
    int i;
    for (i = 0; i <= m->n; ++i) {
        s.play[i] = (real)m->start;
        s.h += (real)m->weight[i] * (real)m->start;
    }
    s.w = s.applied = (real)m->start;
    s.at = (place)m->start;
    return s;
}

static real inside(real x, real low, real high) {
    return x < low ? low : x > high ? high : x;
}

static real play_after(const plant_t *p, const memory_t *s, int i, real w) {
    const real r = (real)p->m->threshold[i];
    return inside(s->play[i], w - r, w + r);
}

/* z/width of an element that has moved on by x >= 0 widths, from s below 0, in closed form: `ds/dx = 1 + k |s|^n`, with
   k = 2 b - 1. Sets what is left of x behind s = 0. */
static real rising(const plant_t *p, real s, real *x) {
    const real k = 2 * (real)p->m->balance - 1, root = sqrtl(k);
    const bool squared = p->m->exponent == 2;
    const real far = k > 0 ? squared ? -atanl(root * s) / root : log1pl(-k * s) / k : -s;
    if (*x >= far) {
        *x -= far;
        return 0;
    }
    const real to = k > 0 ? squared ? tanl(atanl(root * s) + root * *x) / root : s * expl(-k * *x) - expm1l(-k * *x) / k
                          : s + *x;
    *x = 0;
    return to;
}

/* z/width of element j after its input has moved to w: above 0, `ds/dx = 1 - s^n`. Sets its slope in widths. */
static real element_after(const plant_t *p, const memory_t *s, int j, real w, real *slope) {
    const real way = (w - s->w) / (real)p->m->width[j], side = way < 0 ? -1 : 1;
    const bool squared = p->m->exponent == 2;
    real x = side * way, to = side * s->element[j];
    if (p->m->tilt) { /* `ds/dx = 1 + t w - s`, with w in a straight line */
        const real begin = 1 + (real)p->m->tilt[j] * s->w, lean = side * (real)p->m->tilt[j] * (real)p->m->width[j];
        to = to * expl(-x) - (begin - lean) * expm1l(-x) + lean * x;
        *slope = begin + lean * x - to;
        return side * to;
    }
    if (to < 0) {
        to = rising(p, to, &x);
    }
    if (x > 0) {
        to = squared ? (to + tanhl(x)) / (1 + to * tanhl(x)) : to * expl(-x) - expm1l(-x);
    }
    *slope = 1 - (to < 0 ? 1 - 2 * (real)p->m->balance : 1) * (squared ? to * to : fabsl(to));
    return side * to;
}

/* The sum of plays and elements with their input at w, and its slope there in the direction of the move. Elements at
   rest contribute nothing. */
static real plays_at(const plant_t *p, const memory_t *s, real w, real *slope) {
    real sum = (real)p->m->weight[0] * w;
    int i;
    *slope = (real)p->m->weight[0];
    for (i = 1; i <= p->m->n; ++i) {
        const real z = play_after(p, s, i, w);
        sum += (real)p->m->weight[i] * z;
        if (z != s->play[i]) {
            *slope += (real)p->m->weight[i];
        }
    }
    for (i = 0; i < p->m->elements && s->moving; ++i) {
        real steep;
        sum += (real)p->m->part[i] * (real)p->m->width[i] * element_after(p, s, i, w, &steep);
        *slope += (real)p->m->part[i] * steep;
    }
    return sum;
}

/* The input at which the sum is h, which increases with the input. */
static real plays_solved(const plant_t *p, const memory_t *s, real h) {
    const real far = 4 * ((real)p->m->high - (real)p->m->low);
    real slope, w = s->w, low = w - far, high = w + far;
    int i;
    for (i = 0; i < TRIES; ++i) {
        const real left = h - plays_at(p, s, w, &slope);
        real next = w + left / slope;
        if (left > 0) {
            low = w;
        } else {
            high = w;
        }
        if (next == w) {
            break;
        }
        next = next > low && next < high ? next : low + (high - low) / 2;
        if (next == w) {
            break;
        }
        w = next;
    }
    return w;
}

static real aged(const plant_t *p, real travelled) {
    const effects_model_t *m = p->m;
    if (m->ages == AGES_LOGARITHMIC) {
        return 1 - (real)m->loss * log1pl(travelled / (real)m->travel) / logl(10);
    }
    return m->ages == AGES_EXPONENTIAL ? 1 + (real)m->loss * expm1l(-travelled / (real)m->travel) : 1;
}

static real warm_gain(const plant_t *p) {
    return 1 + (real)p->m->gain_per_degree * (p->temperature - (real)p->m->reference);
}

static real warm_offset(const plant_t *p) {
    return (real)p->m->offset_per_degree * (p->temperature - (real)p->m->reference);
}

static real saturated(const plant_t *p, real x) {
    const real level = (real)p->m->level, centre = (real)p->m->centre;
    return p->m->saturates == SATURATES_TANH   ? centre + level * tanhl((x - centre) / level)
           : p->m->saturates == SATURATES_HARD ? inside(x, -level, level)
                                               : x;
}

static real unsaturated(const plant_t *p, real y) {
    const real level = (real)p->m->level, centre = (real)p->m->centre;
    return p->m->saturates == SATURATES_TANH   ? centre + level * atanhl((y - centre) / level)
           : p->m->saturates == SATURATES_HARD ? inside(y, -level, level)
                                               : y;
}

/* Where the amplifier gets on its way to v. */
static place reached(const plant_t *p, const memory_t *s, place v) {
    const place lowest = s->at - p->down, highest = s->at + p->up;
    return !s->moving || !(p->up > 0) ? v : v < lowest ? lowest : v > highest ? highest : v;
}

/* What of creep does not depend on the sum of the plays at this sample. */
static real crept(const plant_t *p, const memory_t *s) {
    real sum = 0;
    int i;
    for (i = 0; i < p->m->creeps; ++i) {
        sum += (real)p->m->share[i] * (p->e[i] * s->creep[i] + p->early[i] * s->h);
    }
    return sum;
}

/* The actuator sees a drive x in front of its lag while v is commanded. Returns the output in front of the gains. */
static real absorb(const plant_t *p, memory_t *s, real v, real x) {
    real h, slope, a = x, y;
    int i;
    if (s->moving) {
        s->travelled += fabsl(v - s->applied);
        ++s->tick;
    }
    if (p->m->lag > 0 && s->moving) {
        const real before = s->lag, gone = 1 - p->lag_kept, theta = p->lag_early / gone;
        s->lag = p->lag_kept * before + gone * x;
        a = (1 - theta) * s->lag + theta * before;
        s->wanted = s->asked + p->lag_late * (x - s->meant);
    } else {
        s->lag = s->wanted = s->asked = s->meant = x;
    }
    h = plays_at(p, s, a, &slope);
    y = h;
    for (i = 0; i < p->m->creeps; ++i) {
        s->creep[i] = s->moving ? p->e[i] * s->creep[i] + p->early[i] * s->h + p->late[i] * h : h;
        y += (real)p->m->share[i] * s->creep[i];
    }
    for (i = 1; i <= p->m->n; ++i) {
        s->play[i] = play_after(p, s, i, a);
    }
    for (i = 0; i < p->m->elements; ++i) {
        s->element[i] = s->moving ? element_after(p, s, i, a, &slope) : 0;
    }
    s->w = a;
    s->h = h;
    s->applied = v;
    s->moving = true;
    return y;
}

/* The drive, not limited yet, that leads to the target z in front of the saturation. */
static real solved(const plant_t *p, memory_t *s, real z) {
    const real cold = (z - warm_offset(p)) / warm_gain(p);
    real now = 1, then = crept(p, s), v = s->applied;
    int i, turn;
    for (i = 0; i < p->m->creeps; ++i) {
        now += (real)p->m->share[i] * (s->moving ? p->late[i] : 1);
    }
    then = s->moving ? then : 0;
    for (turn = 0; turn < (p->m->ages ? TURNS : 1); ++turn) {
        const real way = s->moving ? fabsl(v - s->applied) : 0;
        const real y = cold / aged(p, s->travelled + way);
        real a = plays_solved(p, s, (y - then) / now);
        if (p->m->lag > 0 && s->moving) {
            const real gone = 1 - p->lag_kept, theta = p->lag_early / gone;
            s->asked = a;
            a = (a + theta * (a - s->wanted) - p->lag_kept * s->lag) / gone;
            s->meant = a;
        }
        a = inside((real)reached(p, s, a), (real)p->m->low, (real)p->m->high);
        if (a == v) {
            break;
        }
        v = a;
    }
    return v;
}

static void fault(effects_result_t *out, long k, const char *words, ...) {
    if (out->faults++ == 0) {
        va_list list;
        va_start(list, words);
        vsnprintf(out->message, sizeof out->message, words, list);
        va_end(list);
        out->first = k;
    }
}

static void judge(effects_result_t *out, double *worst, long k, const char *what, real is, real right, double allowed) {
    const real error = fabsl(is - right);
    const double ratio = allowed > 0 ? (double)(error / (real)allowed) : error > 0 ? INFINITY : 0;
    if (!(ratio <= *worst)) {
        *worst = ratio;
    }
    if (!(ratio <= 1)) {
        fault(out, k, "%s: %.12Lg instead of %.12Lg, %.4g times the bound", what, is, right, ratio);
    }
}

/* A number of the module's type, and what it stands for. */
static double argument(const effects_probe_t *q, double x, double lsb) {
    return q->kind == EFFECTS_FIXED ? nearbyint(x / lsb) : q->kind == EFFECTS_F32 ? (double)(float)x : x;
}

void effects_inverse(const effects_model_t *m, const effects_probe_t *q, const effects_call_t *call, long n,
                     double shrink, effects_result_t *out) {
    plant_t p;
    memory_t seen = begun(m), own = begun(m);
    real line[MOST_LINE + 1] = {0}, answer = 0, own_answer = 0, pending_seen = 0, pending_own = 0;
    const real far = (real)fmax(fabs(m->low), fabs(m->high));
    const double lsb = q->kind == EFFECTS_FIXED ? q->drive_lsb : 1;
    const double bit = q->kind == EFFECTS_FIXED ? lsb : (double)far * (q->kind == EFFECTS_F32 ? 0x1p-23 : 0x1p-52);
    const int ahead = (int)ceil(m->delay / m->seconds);
    const real part = ahead ? (real)m->delay / (real)m->seconds - (ahead - 1) : 0;
    const double bound = q->inverse_bound * lsb * shrink, rounding = q->rounding_bound * lsb * shrink;
    bool has_pending = false, filled = false, committed = false;
    long references = 0, k;
    void *self = calloc(1, q->inverse_size);
    memset(out, 0, sizeof *out);
    out->first = -1;
    prepare(&p, m);
    q->inverse_init(self);
    (void)q->inverse_status(self);
    for (k = 0; k < n; ++k) {
        const int what = call[k].call;
        double x = call[k].x;
        if (what == EFFECTS_COMMIT) {
            x = argument(q, x, q->drive_lsb);
            q->inverse_commit(self, x);
            pending_seen = pending_own = (real)x * (real)q->drive_lsb;
            has_pending = committed = true;
            continue;
        }
        if (what == EFFECTS_TEMPERATURE) {
            q->inverse_temperature(self, x);
            p.temperature = (real)x;
            continue;
        }
        if (has_pending && what != EFFECTS_PUSH) {
            seen.at = reached(&p, &seen, pending_seen);
            judge(out, &out->worst_ahead, k, "ahead of the amplifier", (real)(pending_seen - seen.at), 0,
                  committed ? INFINITY : bit);
            seen.at = committed ? pending_seen : seen.at;
            absorb(&p, &seen, pending_seen, pending_seen);
            own.at = pending_own;
            absorb(&p, &own, pending_own, pending_own);
            has_pending = committed = false;
        }
        if (what == EFFECTS_SETTLE) {
            x = argument(q, x, q->drive_lsb);
            q->inverse_settle(self, x);
            memory_t *both[2] = {&seen, &own};
            int i;
            for (i = 0; i < 2; ++i) {
                both[i]->travelled += both[i]->moving ? fabsl((real)x * (real)q->drive_lsb - both[i]->applied) : 0;
                both[i]->tick += both[i]->moving;
                both[i]->moving = false;
                both[i]->at = (real)x * (real)q->drive_lsb;
                absorb(&p, both[i], (real)both[i]->at, (real)both[i]->at);
            }
            (void)q->inverse_status(self);
            continue;
        }
        if (what == EFFECTS_HELD) { /* the last answer once more, as near as the amplifier can get */
            const real before = seen.applied;
            const real right = out->samples ? (real)reached(&p, &seen, answer) : seen.applied;
            const real now = (real)q->inverse_step(self, NAN) * (real)q->drive_lsb;
            const unsigned status = q->inverse_status(self);
            judge(out, &out->worst_seen, k, "held", now, right, 2 * bit);
            if (!(status & HELD) || !(status & SLEW_LIMITED) != !(fabsl(right - answer) > bit)) {
                if (!(fabsl(fabsl(right - answer) - bit) <= bit)) {
                    fault(out, k, "status %u of a held sample from %.9Lg to %.9Lg", status, before, answer);
                }
            }
            if (ahead) {
                memmove(line, line + 1, (size_t)ahead * sizeof *line);
            }
            pending_own = own_answer = out->samples ? (real)reached(&p, &own, own_answer) : own.applied;
            pending_seen = answer = now;
            has_pending = true;
            ++out->samples;
            continue;
        }
        x = argument(q, x, q->output_lsb);
        x = fmin(fmax(x, q->output_min), q->output_max);
        const real u = (real)x * (real)q->output_lsb;
        const long tick = seen.tick + seen.moving + (references < ahead ? references : ahead); /* of this reference */
        const real z = unsaturated(&p, u - (real)m->offset - (real)m->drift * (real)tick * (real)m->seconds);
        ++references;
        int i;
        if (!filled) {
            for (i = 0; i <= ahead; ++i) {
                line[i] = z;
            }
            filled = true;
        } else {
            memmove(line, line + 1, (size_t)ahead * sizeof *line);
            line[ahead] = z;
        }
        if (what == EFFECTS_PUSH) {
            q->inverse_push(self, x);
            continue;
        }
        const real target = ahead ? line[ahead - 1] + part * (line[ahead] - line[ahead - 1]) : z;
        own.travelled = seen.travelled; /* rounded drives travel farther, and the actuator with them */
        const real right = solved(&p, &seen, target), alone = solved(&p, &own, target);
        const double raw = q->inverse_step(self, x);
        const unsigned status = q->inverse_status(self);
        const real now = (real)raw * (real)q->drive_lsb;
        if (!(raw >= q->drive_min && raw <= q->drive_max)) {
            fault(out, k, "drive %.12g outside its range", raw);
        }
        if (status & HELD) {
            fault(out, k, "a held sample's status at %.9g", x);
        }
        if (p.up > 0 && seen.moving) {
            const place free_up = p.up, free_down = p.down;
            if (!(status & SLEW_LIMITED)) { /* twice the rate must not lead farther */
                p.up *= 2, p.down *= 2;
                if (fabsl(solved(&p, &seen, target) - right) > (real)rounding + 2 * bit) {
                    fault(out, k, "no status of a limited rate");
                }
                p.up = free_up, p.down = free_down;
            }
            out->limited += (status & SLEW_LIMITED) != 0;
        }
        if (!m->ages || fabsl(right - seen.applied) <= (real)q->fastest * (real)m->seconds) { /* ageing is a sample late */
            judge(out, &out->worst_seen, k, "with the memory of what was applied", now, right, rounding + bit);
            judge(out, &out->worst_own, k, "against a compensator of its own", now, alone, bound);
        }
        pending_seen = answer = now;
        pending_own = own_answer = alone;
        has_pending = true;
        ++out->samples;
    }
    free(self);
}

void effects_forward(const effects_model_t *m, const effects_probe_t *q, const effects_call_t *call, long n,
                     double shrink, effects_result_t *out) {
    plant_t p;
    memory_t s = begun(m);
    real line[MOST_LINE + 2] = {0};
    const int whole = (int)ceil(m->delay / m->seconds);
    const real part = whole - (real)m->delay / (real)m->seconds;
    const double lsb = q->kind == EFFECTS_FIXED ? q->output_lsb : 1;
    void *self = calloc(1, q->forward_size);
    long k;
    memset(out, 0, sizeof *out);
    out->first = -1;
    prepare(&p, m);
    q->forward_init(self);
    for (k = 0; k < n; ++k) {
        if (call[k].call == EFFECTS_TEMPERATURE) {
            q->forward_temperature(self, call[k].x);
            p.temperature = (real)call[k].x;
            continue;
        }
        const double x = fmin(fmax(argument(q, call[k].x, q->drive_lsb), q->drive_min), q->drive_max);
        const real v = (real)x * (real)q->drive_lsb;
        int i;
        for (i = 0; i <= whole + 1; ++i) {
            line[i] = s.moving && i <= whole ? line[i + 1] : v;
        }
        const real late = whole ? line[1] + part * (line[2] - line[1]) : v;
        s.at = reached(&p, &s, late);
        const real y = absorb(&p, &s, v, (real)s.at) * aged(&p, s.travelled) * warm_gain(&p) + warm_offset(&p);
        const real right = saturated(&p, y) + (real)m->offset + (real)m->drift * (real)s.tick * (real)m->seconds;
        const real now = (real)q->forward_step(self, x) * (real)q->output_lsb;
        judge(out, &out->worst_forward, k, "displacement", now, right, q->forward_bound * lsb * shrink);
        ++out->samples;
    }
    free(self);
}
