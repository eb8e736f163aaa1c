/* The recursive Newton-Euler algorithm as a loop over bodies, in single precision: what generated code is compared with. It has what a
 * careful library has: fixed links folded, 3-vectors in the bodies' axes, every joint about its z axis, placements by kind (none, about x,
 * about y, general), a short pair of sine and cosine, nothing passed on to a base that does not move.
 *
 * Before this file come ROBOT (the function's name), BODIES, FLOATING, GRAVITY, and behind `struct body` the table `bodies` (TABLE). */
#include <stdint.h>

enum kind { NONE, ABOUT_X, ABOUT_Y, GENERAL };

struct body {
    int parent; /* -1: the world */
    enum kind kind;
    float cosine, sine;     /* of a rotation about one axis */
    float rotation[9];      /* general, by rows; columns are the body's axes in the parent's */
    float place[3];         /* the origin in the parent */
    float mass, moment[3];  /* first moment */
    float inertia[6];       /* about the origin: xx yy zz xy xz yz */
};

TABLE

#define ALWAYS static inline __attribute__((always_inline))

struct state {
    float omega[3], epsilon[3], a[3], force[3], torque[3], sine, cosine;
};

ALWAYS void sine_and_cosine(float x, float *sine, float *cosine)
{
    float n = x * 0.63661975f;
    int32_t quadrant = (int32_t)(n + (n < 0 ? -0.5f : 0.5f));
    float k = (float)quadrant;
    float y = (x - k * 1.5707964f) + k * 4.371139e-8f, z = y * y;
    float s = y + y * z * (-0.16666667f + z * (8.3333340e-3f + z * -1.9852995e-4f));
    float c = 1.0f + z * (-0.5f + z * (0.041666646f + z * (-1.3887310e-3f + z * 2.4432327e-5f)));
    if (quadrant & 1) {
        float t = s;
        s = c;
        c = t;
    }
    *sine = quadrant & 2 ? -s : s;
    *cosine = (quadrant + 1) & 2 ? -c : c;
}

ALWAYS void cross(float *out, const float *a, const float *b)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* into the body's axes */
ALWAYS void outward(float *out, const struct body *b, const struct state *s, const float *v)
{
    float x = v[0], y = v[1], z = v[2];
    const float *r = b->rotation;
    switch (b->kind) {
    case NONE: break;
    case ABOUT_X:
        y = b->cosine * v[1] + b->sine * v[2];
        z = b->cosine * v[2] - b->sine * v[1];
        break;
    case ABOUT_Y:
        x = b->cosine * v[0] - b->sine * v[2];
        z = b->cosine * v[2] + b->sine * v[0];
        break;
    case GENERAL:
        x = r[0] * v[0] + r[3] * v[1] + r[6] * v[2];
        y = r[1] * v[0] + r[4] * v[1] + r[7] * v[2];
        z = r[2] * v[0] + r[5] * v[1] + r[8] * v[2];
    }
    out[0] = s->cosine * x + s->sine * y;
    out[1] = s->cosine * y - s->sine * x;
    out[2] = z;
}

/* into the parent's axes */
ALWAYS void inward(float *out, const struct body *b, const struct state *s, const float *v)
{
    float x = s->cosine * v[0] - s->sine * v[1], y = s->cosine * v[1] + s->sine * v[0], z = v[2];
    const float *r = b->rotation;
    switch (b->kind) {
    case NONE:
        out[0] = x;
        out[1] = y;
        out[2] = z;
        break;
    case ABOUT_X:
        out[0] = x;
        out[1] = b->cosine * y - b->sine * z;
        out[2] = b->cosine * z + b->sine * y;
        break;
    case ABOUT_Y:
        out[0] = b->cosine * x + b->sine * z;
        out[1] = y;
        out[2] = b->cosine * z - b->sine * x;
        break;
    case GENERAL:
        out[0] = r[0] * x + r[1] * y + r[2] * z;
        out[1] = r[3] * x + r[4] * y + r[5] * z;
        out[2] = r[6] * x + r[7] * y + r[8] * z;
    }
}

ALWAYS void times(float *out, const float *j, const float *v)
{
    out[0] = j[0] * v[0] + j[3] * v[1] + j[4] * v[2];
    out[1] = j[3] * v[0] + j[1] * v[1] + j[5] * v[2];
    out[2] = j[4] * v[0] + j[5] * v[1] + j[2] * v[2];
}

/* Newton and Euler about the origin */
ALWAYS void balance(struct state *s, const struct body *b)
{
    float t[3], u[3], v[3], l[3];
    cross(t, s->omega, b->moment);
    cross(u, s->omega, t);
    cross(v, s->epsilon, b->moment);
    for (int i = 0; i < 3; i++)
        s->force[i] = b->mass * s->a[i] + v[i] + u[i];
    times(l, b->inertia, s->omega);
    times(v, b->inertia, s->epsilon);
    cross(t, s->omega, l);
    cross(u, b->moment, s->a);
    for (int i = 0; i < 3; i++)
        s->torque[i] = v[i] + t[i] + u[i];
}

/* q of a floating base: position, quaternion x y z w; its rates: linear, then angular, in its own axes */
__attribute__((noinline)) void ROBOT(const float *q, const float *qd, const float *qdd, float *tau)
{
    struct state states[BODIES];
    static const float gravity[3] = GRAVITY;
    for (int j = 0; j < BODIES; j++) {
        const struct body *b = &bodies[j];
        struct state *s = &states[j];
        if (FLOATING && j == 0) {
            float x = q[3], y = q[4], z = q[5], w = q[6], t[3];
            /* gravity is along the world's z */
            float up[3] = {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
            for (int i = 0; i < 3; i++) {
                s->omega[i] = qd[3 + i];
                s->epsilon[i] = qdd[3 + i];
            }
            cross(t, s->omega, qd);
            for (int i = 0; i < 3; i++)
                s->a[i] = qdd[i] + t[i] - gravity[2] * up[i];
            balance(s, b);
            q += 7, qd += 6, qdd += 6, tau += 6;
            continue;
        }
        sine_and_cosine(*q++, &s->sine, &s->cosine);
        float rate = *qd++, a[3];
        if (b->parent < 0) {
            for (int i = 0; i < 3; i++) {
                a[i] = -gravity[i];
                s->omega[i] = s->epsilon[i] = 0;
            }
        } else {
            const struct state *p = &states[b->parent];
            float t[3], u[3];
            cross(t, p->omega, b->place);
            cross(u, p->omega, t);
            cross(t, p->epsilon, b->place);
            for (int i = 0; i < 3; i++)
                a[i] = p->a[i] + t[i] + u[i];
            outward(s->omega, b, s, p->omega);
            outward(s->epsilon, b, s, p->epsilon);
        }
        outward(s->a, b, s, a);
        s->epsilon[0] += s->omega[1] * rate;
        s->epsilon[1] -= s->omega[0] * rate;
        s->epsilon[2] += *qdd++;
        s->omega[2] += rate;
        balance(s, b);
        tau++;
    }
    for (int j = BODIES - 1; j >= 0; j--) {
        const struct body *b = &bodies[j];
        const struct state *s = &states[j];
        if (FLOATING && j == 0) {
            tau -= 6;
            for (int i = 0; i < 3; i++) {
                tau[i] = s->force[i];
                tau[3 + i] = s->torque[i];
            }
            continue;
        }
        *--tau = s->torque[2];
        if (b->parent < 0)
            continue;
        struct state *p = &states[b->parent];
        float f[3], n[3], t[3];
        inward(f, b, s, s->force);
        inward(n, b, s, s->torque);
        cross(t, b->place, f);
        for (int i = 0; i < 3; i++) {
            p->force[i] += f[i];
            p->torque[i] += n[i] + t[i];
        }
    }
}
