/* Exported dynamics as solvers of optimal control ask for them: x = (q, qd), u = tau, matrices by columns.
 *
 *     straightline export panda.urdf -o panda-c99 --c99 --function forward_dynamics --function forward_dynamics_derivatives
 *
 *     #include "panda_dynamics.h"
 *     #define OC_ROBOT panda        the prefix of the exported functions
 *     #define OC_NV PANDA_NV
 *     #include "optimal_control.h"
 *
 * gives panda_oc_ode and the others below, as static functions of C99 and C++; for another robot define both anew and include it again.
 * Coordinates have to be as many as velocities: a floating base has a quaternion, and only panda_oc_differential_action. The numbers
 * are double. SI units. */

#if !defined(OC_ROBOT) || !defined(OC_NV)
#error "define OC_ROBOT and OC_NV"
#endif

#ifndef OC_JOINED
#define OC_JOINED_HERE(robot, name) robot##_##name
#define OC_JOINED(robot, name) OC_JOINED_HERE(robot, name)
#endif
#define OC_NAME(name) OC_JOINED(OC_ROBOT, name)
#define OC_NX (2 * OC_NV)

#ifdef __cplusplus
#define OC_FUNCTION static inline
#elif defined(__GNUC__)
#define OC_FUNCTION static __attribute__((unused))
#else
#define OC_FUNCTION static
#endif

/* Crocoddyl's DifferentialActionModel: xout = qdd, Fx = (dqdd/dq dqdd/dqd), NV x 2NV, Fu = dqdd/dtau, NV x NV. Of a floating base q has the
 * coordinates of the exported functions, and columns are increments in the axes of the base: Pinocchio's tangent. */
OC_FUNCTION void OC_NAME(oc_differential_action)(const double *q, const double *v, const double *u, double *xout, double *Fx, double *Fu)
{
    double by_q[OC_NV * OC_NV], by_v[OC_NV * OC_NV], inverse[OC_NV * OC_NV];
    int i, j;
    OC_NAME(forward_dynamics_derivatives)(q, v, u, xout, by_q, by_v, inverse);
    for (i = 0; i < OC_NV; i++) {
        for (j = 0; j < OC_NV; j++) {
            Fx[i + OC_NV * j] = by_q[OC_NV * i + j];
            Fx[i + OC_NV * (OC_NV + j)] = by_v[OC_NV * i + j];
            Fu[i + OC_NV * j] = inverse[OC_NV * i + j];
        }
    }
}

/* f = dx/dt. */
OC_FUNCTION void OC_NAME(oc_ode)(const double *x, const double *u, double *f)
{
    int i;
    OC_NAME(forward_dynamics)(x, x + OC_NV, u, f + OC_NV);
    for (i = 0; i < OC_NV; i++) f[i] = x[OC_NV + i];
}

/* f with A = df/dx, NX x NX, and B = df/du, NX x NV. */
OC_FUNCTION void OC_NAME(oc_ode_jacobians)(const double *x, const double *u, double *f, double *A, double *B)
{
    double Fx[OC_NV * OC_NX], Fu[OC_NV * OC_NV];
    int i, j;
    OC_NAME(oc_differential_action)(x, x + OC_NV, u, f + OC_NV, Fx, Fu);
    for (i = 0; i < OC_NV; i++) {
        f[i] = x[OC_NV + i];
        for (j = 0; j < OC_NX; j++) {
            A[i + OC_NX * j] = j == OC_NV + i ? 1.0 : 0.0;
            A[OC_NV + i + OC_NX * j] = Fx[i + OC_NV * j];
        }
        for (j = 0; j < OC_NV; j++) {
            B[i + OC_NX * j] = 0.0;
            B[OC_NV + i + OC_NX * j] = Fu[i + OC_NV * j];
        }
    }
}

/* The state after h seconds with u held: one step of the classical Runge-Kutta method. */
OC_FUNCTION void OC_NAME(oc_step)(const double *x, const double *u, double h, double *next)
{
    static const double along[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double f[OC_NX] = {0.0}, at[OC_NX];
    int i, stage;
    for (i = 0; i < OC_NX; i++) next[i] = x[i];
    for (stage = 0; stage < 4; stage++) {
        for (i = 0; i < OC_NX; i++) at[i] = x[i] + along[stage] * h * f[i];
        OC_NAME(oc_ode)(at, u, f);
        for (i = 0; i < OC_NX; i++) next[i] += weight[stage] / 6.0 * h * f[i];
    }
}

/* The same with A = dnext/dx and B = dnext/du: each stage k_i = f(x + a_i h k_{i-1}, u) by the chain rule. */
OC_FUNCTION void OC_NAME(oc_step_jacobians)(const double *x, const double *u, double h, double *next, double *A, double *B)
{
    static const double along[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double f[OC_NX] = {0.0}, at[OC_NX], by_x[OC_NX * OC_NX], by_u[OC_NX * OC_NV];
    /* slopes of k by x and u together, and those of the stage before */
    double slope[OC_NX * (OC_NX + OC_NV)] = {0.0}, before[OC_NX * (OC_NX + OC_NV)];
    int i, j, k, stage;
    for (i = 0; i < OC_NX; i++) next[i] = x[i];
    for (i = 0; i < OC_NX * OC_NX; i++) A[i] = i % (OC_NX + 1) == 0 ? 1.0 : 0.0;
    for (i = 0; i < OC_NX * OC_NV; i++) B[i] = 0.0;
    for (stage = 0; stage < 4; stage++) {
        for (i = 0; i < OC_NX; i++) at[i] = x[i] + along[stage] * h * f[i];
        OC_NAME(oc_ode_jacobians)(at, u, f, by_x, by_u);
        for (i = 0; i < OC_NX * (OC_NX + OC_NV); i++) before[i] = slope[i];
        for (j = 0; j < OC_NX + OC_NV; j++) {
            for (i = 0; i < OC_NX; i++) {
                double sum = j < OC_NX ? by_x[i + OC_NX * j] : by_u[i + OC_NX * (j - OC_NX)];
                for (k = 0; k < OC_NX; k++) sum += along[stage] * h * by_x[i + OC_NX * k] * before[k + OC_NX * j];
                slope[i + OC_NX * j] = sum;
            }
        }
        for (i = 0; i < OC_NX; i++) next[i] += weight[stage] / 6.0 * h * f[i];
        for (i = 0; i < OC_NX * OC_NX; i++) A[i] += weight[stage] / 6.0 * h * slope[i];
        for (i = 0; i < OC_NX * OC_NV; i++) B[i] += weight[stage] / 6.0 * h * slope[OC_NX * OC_NX + i];
    }
}

/* CasADi's calling convention, which acados has for its explicit integrators (expl_ode_fun, expl_vde_forw): inputs x, Sx, Su, u, p; outputs
 * f, A Sx, A Su + B. Outputs that are null pointers are not wanted. */
OC_FUNCTION int OC_NAME(oc_expl_ode_fun)(const double **arg, double **res, int *iw, double *w, void *mem)
{
    (void)iw, (void)w, (void)mem;
    if (res[0]) OC_NAME(oc_ode)(arg[0], arg[1], res[0]);
    return 0;
}

OC_FUNCTION int OC_NAME(oc_expl_vde_forw)(const double **arg, double **res, int *iw, double *w, void *mem)
{
    double f[OC_NX], A[OC_NX * OC_NX], B[OC_NX * OC_NV];
    int i, j, k;
    (void)iw, (void)w, (void)mem;
    OC_NAME(oc_ode_jacobians)(arg[0], arg[3], f, A, B);
    for (i = 0; res[0] && i < OC_NX; i++) res[0][i] = f[i];
    for (j = 0; j < OC_NX + OC_NV; j++) {
        int is_state = j < OC_NX, column = is_state ? j : j - OC_NX;
        const double *seed = (is_state ? arg[1] : arg[2]) + OC_NX * column;
        double *out = is_state ? res[1] : res[2];
        for (i = 0; out && i < OC_NX; i++) {
            double sum = is_state ? 0.0 : B[i + OC_NX * column];
            for (k = 0; k < OC_NX; k++) sum += A[i + OC_NX * k] * seed[k];
            out[i + OC_NX * column] = sum;
        }
    }
    return 0;
}

/* acados' discrete dynamics by a generic external function (dyn_ext_fun_type = 'generic'), with OC_STEP seconds between nodes: name
 * OC_ROBOT_oc_disc_dyn_fun and OC_ROBOT_oc_disc_dyn_fun_jac as dyn_disc_fun and dyn_disc_fun_jac. */
#ifdef OC_STEP
#include "acados/utils/external_function_generic.h"
#include "blasfeo_d_aux.h"

#ifdef __cplusplus
extern "C" {
#endif

int OC_NAME(oc_disc_dyn_fun)(void **in, void **out, void *params);
int OC_NAME(oc_disc_dyn_fun_jac)(void **in, void **out, void *params);

int OC_NAME(oc_disc_dyn_fun)(void **in, void **out, void *params)
{
    struct blasfeo_dvec_args *x_args = (struct blasfeo_dvec_args *)in[0], *u_args = (struct blasfeo_dvec_args *)in[1];
    struct blasfeo_dvec_args *next_args = (struct blasfeo_dvec_args *)out[0];
    double x[OC_NX], u[OC_NV], next[OC_NX];
    (void)params;
    blasfeo_unpack_dvec(OC_NX, x_args->x, x_args->xi, x, 1);
    blasfeo_unpack_dvec(OC_NV, u_args->x, u_args->xi, u, 1);
    OC_NAME(oc_step)(x, u, OC_STEP, next);
    blasfeo_pack_dvec(OC_NX, next, 1, next_args->x, next_args->xi);
    return 0;
}

/* The Jacobian stands as (B A) transposed. */
int OC_NAME(oc_disc_dyn_fun_jac)(void **in, void **out, void *params)
{
    struct blasfeo_dvec_args *x_args = (struct blasfeo_dvec_args *)in[0], *u_args = (struct blasfeo_dvec_args *)in[1];
    struct blasfeo_dvec_args *next_args = (struct blasfeo_dvec_args *)out[0];
    struct blasfeo_dmat_args *jacobian = (struct blasfeo_dmat_args *)out[1];
    double x[OC_NX], u[OC_NV], next[OC_NX], A[OC_NX * OC_NX], B[OC_NX * OC_NV];
    (void)params;
    blasfeo_unpack_dvec(OC_NX, x_args->x, x_args->xi, x, 1);
    blasfeo_unpack_dvec(OC_NV, u_args->x, u_args->xi, u, 1);
    OC_NAME(oc_step_jacobians)(x, u, OC_STEP, next, A, B);
    blasfeo_pack_dvec(OC_NX, next, 1, next_args->x, next_args->xi);
    blasfeo_pack_tran_dmat(OC_NX, OC_NV, B, OC_NX, jacobian->A, jacobian->ai, jacobian->aj);
    blasfeo_pack_tran_dmat(OC_NX, OC_NX, A, OC_NX, jacobian->A, jacobian->ai + OC_NV, jacobian->aj);
    return 0;
}

#ifdef __cplusplus
}
#endif
#endif

#undef OC_NAME
#undef OC_NX
#undef OC_FUNCTION
