//! Generates the dynamics of every robot from its description.

use straightline_codegen::fronts::builder::Error;
use straightline_codegen::{Builder, Scalar};

const FEET: [&str; 4] = ["FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"];

fn main() -> Result<(), Error> {
    Builder::new("descriptions/planar_2r.toml").frames(["tip"]).build()?;
    let driven = |scene: &str| Builder::new("descriptions/planar_2r.toml").frames(["tip"]).scene_file(scene);
    driven("scenes/planar_2r_drives.toml").module("planar_2r_geared").build()?;
    driven("scenes/planar_2r_elastic.toml").module("planar_2r_elastic").build()?;
    Builder::new("descriptions/chapter_cylindrical.toml").module("cylindrical").build()?;
    Builder::new("descriptions/chapter_stanford.toml").module("stanford").build()?;
    Builder::new("descriptions/puma560.urdf").build()?;
    // the file has 1.57079632679 for π/2
    Builder::new("descriptions/ur5.urdf").frames(["tool0"]).angle_tolerance(1e-11).build()?;
    Builder::new("descriptions/ur5.urdf")
        .angle_tolerance(1e-11)
        .scene_file("scenes/ur5_contact_tasks.toml")
        .module("ur5_contact")
        .build()?;
    let panda = || Builder::new("descriptions/panda.urdf").frames(["panda_hand_tcp"]);
    panda().build()?;
    panda().module("panda_single").scalar(Scalar::F32).build()?;
    let solo12 = || Builder::new("descriptions/solo12.urdf").floating_base(true).frames(FEET);
    solo12().build()?;
    solo12().module("solo12_single").scalar(Scalar::F32).build()?;
    Ok(())
}
