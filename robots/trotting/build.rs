//! Generates the dynamics of the quadruped, once as its controller knows it and once as it is simulated.

use straightline_codegen::fronts::builder::Error;
use straightline_codegen::Builder;

fn main() -> Result<(), Error> {
    let solo12 = |scene: &str| Builder::new("../descriptions/solo12.urdf").scene_file(scene);
    solo12("../scenes/quadruped_trot.toml").module("solo12").build()?;
    solo12("../scenes/quadruped_plant.toml").module("plant").build()?;
    Ok(())
}
