//! The header for solvers of optimal control, `guide/src/optimal_control.h`, around an exported package: compiled strictly, its Jacobians
//! against difference quotients. Against acados and Crocoddyl where `ACADOS_INSTALL` and
//! `CROCODDYL_PREFIX` say where they are.

use crate::in_c::{is_there, succeeds};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const UR5: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/descriptions/ur5.urdf");
const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../guide/src");

/// A package of a UR5 in C99; `None` where there is no compiler.
fn package(name: &str) -> Option<PathBuf> {
    if !is_there("cc") {
        eprintln!("skipped: there is no C compiler");
        return None;
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("optimal_control").join(name);
    fs::create_dir_all(path.parent()?).unwrap();
    let functions = ["--function", "forward_dynamics", "--function", "forward_dynamics_derivatives"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
    command.args(["export", UR5, "--c99", "--angle-tolerance", "1e-11"]).args(functions);
    succeeds(command.arg("-o").arg(&path));
    Some(path)
}

const HEAD: &str = "#include \"ur5_dynamics.h\"\n#define OC_ROBOT ur5\n#define OC_NV UR5_NV\n";

/// Differences with a step of 1e-5: its square times third derivatives of accelerations near 50, and 1e-16 of these by the step, below 1e-7.
const PROGRAM: &str = r#"#include "optimal_control.h"
#include <math.h>
#include <stdio.h>
#define NX (2 * UR5_NV)
static const double x[NX] = {0.3, -1.2, 1.5, -0.4, 1.1, 0.7, 0.5, -0.8, 0.3, 1.2, -0.6, 0.9}, u[UR5_NV] = {5, -30, 12, 3, -1, 0.5};
static double off(double found, double slope) { return fabs(found - slope) / (1 + fabs(slope)); }
int main(void) {
    double f[NX], again[NX], A[NX * NX], B[NX * UR5_NV], next[NX], Ad[NX * NX], Bd[NX * UR5_NV], worst[3] = {0, 0, 0};
    double Sx[NX * NX], Su[NX * UR5_NV], Vx[NX * NX], Vu[NX * UR5_NV], qdd[UR5_NV], Fx[UR5_NV * NX], Fu[UR5_NV * UR5_NV];
    const double h = 1e-5, T = 0.02;
    ur5_oc_ode_jacobians(x, u, f, A, B);
    ur5_oc_step_jacobians(x, u, T, next, Ad, Bd);
    ur5_oc_ode(x, u, again);
    for (int i = 0; i < NX; i++) if (off(f[i], again[i]) > 1e-12) return 1;
    ur5_oc_step(x, u, T, again);
    for (int i = 0; i < NX; i++) if (off(next[i], again[i]) > 1e-12) return 2;
    for (int j = 0; j < NX + UR5_NV; j++) {
        double low[2][NX], high[2][NX];
        for (int side = 0; side < 2; side++) {
            double xs[NX], us[UR5_NV];
            for (int i = 0; i < NX; i++) xs[i] = x[i] + (i == j ? (side ? h : -h) : 0);
            for (int i = 0; i < UR5_NV; i++) us[i] = u[i] + (NX + i == j ? (side ? h : -h) : 0);
            ur5_oc_ode(xs, us, side ? high[0] : low[0]);
            ur5_oc_step(xs, us, T, side ? high[1] : low[1]);
        }
        for (int i = 0; i < NX; i++) {
            const double *c = j < NX ? A + NX * j : B + NX * (j - NX), *d = j < NX ? Ad + NX * j : Bd + NX * (j - NX);
            worst[0] = fmax(worst[0], off(c[i], (high[0][i] - low[0][i]) / (2 * h)));
            worst[1] = fmax(worst[1], off(d[i], (high[1][i] - low[1][i]) / (2 * h)));
        }
    }
    for (int i = 0; i < NX * NX; i++) Sx[i] = sin(i + 1.0);
    for (int i = 0; i < NX * UR5_NV; i++) Su[i] = cos(i + 1.0);
    const double *arg[5] = {x, Sx, Su, u, 0};
    double *res[3] = {again, Vx, Vu};
    if (ur5_oc_expl_vde_forw(arg, res, 0, 0, 0)) return 3;
    for (int j = 0; j < UR5_NV; j++) for (int i = 0; i < NX; i++) {
        double ux = B[i + NX * j], xx = 0;
        for (int k = 0; k < NX; k++) { ux += A[i + NX * k] * Su[k + NX * j]; xx += A[i + NX * k] * Sx[k + NX * j]; }
        worst[2] = fmax(worst[2], fmax(off(Vu[i + NX * j], ux), off(Vx[i + NX * j], xx)));
    }
    const double *plain[3] = {x, u, 0};
    double *rate[1] = {again};
    if (ur5_oc_expl_ode_fun(plain, rate, 0, 0, 0)) return 4;
    for (int i = 0; i < NX; i++) if (off(f[i], again[i]) > 1e-12) return 5;
    ur5_oc_differential_action(x, x + UR5_NV, u, qdd, Fx, Fu);
    for (int j = 0; j < NX; j++) for (int i = 0; i < UR5_NV; i++) if (Fx[i + UR5_NV * j] != A[UR5_NV + i + NX * j]) return 6;
    printf("%g %g %g\n", worst[0], worst[1], worst[2]);
    return 0;
}
"#;

/// What a program prints that was compiled with the package.
fn printed(package: &Path, name: &str, compiler: &[&str], further: &[String], text: &str) -> String {
    let (source, built) = (package.join(name), package.join(format!("{name}.out")));
    fs::write(&source, text).unwrap();
    let dynamics = package.join("ur5.o");
    succeeds(
        Command::new("cc").args(["-std=c99", "-O1", "-c"]).arg(package.join("ur5_dynamics.c")).arg("-o").arg(&dynamics),
    );
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).args(["-O1", "-I", GUIDE, "-I"]).arg(package).arg(&source).arg(&dynamics);
    succeeds(command.args(further).args(["-lm", "-o"]).arg(&built));
    succeeds(&mut Command::new(&built))
}

const STRICT: [&str; 6] = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"];

#[test]
fn jacobians_for_solvers_are_the_slopes_of_the_equations_and_of_the_step() {
    let Some(package) = package("plain") else { return };
    let said = printed(&package, "main.c", &STRICT, &[], &format!("{HEAD}{PROGRAM}"));
    let worst: Vec<f64> = said.split_whitespace().map(|x| x.parse().unwrap()).collect();
    assert!(worst[0] < 1e-7 && worst[1] < 1e-7 && worst[2] < 1e-12, "{said}");
    if is_there("c++") {
        let strict = ["c++", "-std=c++11", "-Wall", "-Wextra", "-Werror"];
        let cpp =
            format!("{HEAD}#include \"optimal_control.h\"\nint main() {{ double f[12]; ur5_oc_ode(f, f, f); }}\n");
        let cpp = cpp.replace("ur5_oc_ode(f, f, f)", "double x[12] = {0}, u[6] = {0}; ur5_oc_ode(x, u, f)");
        assert_eq!(printed(&package, "main.cpp", &strict, &[], &cpp), "");
    }
}

/// A solver's own data structures, filled and read by its own functions.
const ACADOS: &str = r#"#define OC_STEP 0.02
#include "optimal_control.h"
#include <math.h>
#include <stdio.h>
int main(void) {
    double x[12] = {0.3, -1.2, 1.5, -0.4, 1.1, 0.7, 0.5, -0.8, 0.3, 1.2, -0.6, 0.9}, u[6] = {5, -30, 12, 3, -1, 0.5}, worst = 0;
    double next[12], A[144], B[72];
    struct blasfeo_dvec sx, su, sn;
    struct blasfeo_dmat sj;
    blasfeo_allocate_dvec(12, &sx); blasfeo_allocate_dvec(6, &su); blasfeo_allocate_dvec(12, &sn); blasfeo_allocate_dmat(18, 12, &sj);
    blasfeo_pack_dvec(12, x, 1, &sx, 0); blasfeo_pack_dvec(6, u, 1, &su, 0);
    struct blasfeo_dvec_args ax = {0}, au = {0}, an = {0};
    struct blasfeo_dmat_args aj = {0};
    ax.x = &sx; au.x = &su; an.x = &sn; aj.A = &sj;
    void *in[2] = {&ax, &au}, *out[2] = {&an, &aj};
    if (ur5_oc_disc_dyn_fun_jac(in, out, 0)) return 1;
    ur5_oc_step_jacobians(x, u, OC_STEP, next, A, B);
    for (int i = 0; i < 12; i++) {
        worst = fmax(worst, fabs(BLASFEO_DVECEL(&sn, i) - next[i]));
        for (int j = 0; j < 6; j++) worst = fmax(worst, fabs(BLASFEO_DMATEL(&sj, j, i) - B[i + 12 * j]));
        for (int j = 0; j < 12; j++) worst = fmax(worst, fabs(BLASFEO_DMATEL(&sj, 6 + j, i) - A[i + 12 * j]));
    }
    if (ur5_oc_disc_dyn_fun(in, out, 0)) return 2;
    for (int i = 0; i < 12; i++) worst = fmax(worst, fabs(BLASFEO_DVECEL(&sn, i) - next[i]));
    /* what acados calls expl_vde_forw has this type */
    external_function_casadi fun;
    fun.casadi_fun = &ur5_oc_expl_vde_forw;
    printf("%g %d\n", worst, fun.casadi_fun != 0);
    return 0;
}
"#;

#[test]
fn acados_takes_the_functions() {
    let Some(root) = std::env::var_os("ACADOS_INSTALL") else {
        eprintln!("skipped: ACADOS_INSTALL does not say where include/ and lib/ of acados are");
        return;
    };
    let Some(package) = package("acados") else { return };
    let root = root.to_string_lossy();
    let include = ["", "/acados", "/blasfeo/include", "/hpipm/include"].map(|path| format!("-I{root}/include{path}"));
    let library = [format!("-L{root}/lib"), "-lblasfeo".to_string(), format!("-Wl,-rpath,{root}/lib")];
    let further = [&include[..], &library].concat();
    let said = printed(&package, "acados.c", &["cc", "-std=gnu99", "-Wall"], &further, &format!("{HEAD}{ACADOS}"));
    // the step alone and the step with its Jacobians round in their own orders
    let worst: f64 = said.trim().strip_suffix(" 1").unwrap().parse().unwrap();
    assert!(worst < 1e-14, "{said}");
}

#[test]
fn crocoddyl_takes_the_functions() {
    let Some(root) = std::env::var_os("CROCODDYL_PREFIX") else {
        eprintln!("skipped: CROCODDYL_PREFIX does not say where include/ and lib/ of Crocoddyl are");
        return;
    };
    let Some(package) = package("crocoddyl") else { return };
    let root = root.to_string_lossy();
    let eigen = std::env::var("EIGEN_INCLUDE").unwrap_or_else(|_| format!("{root}/include/eigen3"));
    let further = [
        format!("-I{root}/include"),
        format!("-isystem{eigen}"),
        format!("-L{root}/lib"),
        "-lcrocoddyl".to_string(),
        // its libraries look for theirs there, too
        format!("-Wl,--disable-new-dtags,-rpath,{root}/lib"),
    ];
    let text = fs::read_to_string(Path::new(GUIDE).join("crocoddyl_ur5.cpp")).unwrap();
    let said = printed(&package, "crocoddyl.cpp", &["c++", "-std=c++17"], &further, &text);
    let worst: Vec<f64> = said.split_whitespace().map(|x| x.parse().unwrap()).collect();
    // Crocoddyl's own difference quotients have steps of 1e-8 of accelerations near 50
    assert!(worst.len() == 2 && worst[0] < 1e-4 && worst[1] < 1e-4, "{said}");
}
