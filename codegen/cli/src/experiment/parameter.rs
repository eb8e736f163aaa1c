//! Numbers of a robot file, and of the drives of its scene, that a sweep changes, by a path such as `forearm.mass`, `elbow.damping` or
//! `elbow_drive.ratio`.

use super::messages as say;
use straightline_codegen::description::drives::WrittenDrive;
use straightline_codegen::description::{Description, JointDrive, Noted, WrittenInertial};
use straightline_codegen::diagnostic::Diagnostic;

/// A parameter and the values that it is to have.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// `LINK.mass`, `JOINT.damping`, …
    pub path: String,
    /// Values in the file's unit.
    pub values: Vec<f64>,
}

/// Reads `PATH=a,b,c` or `PATH=from:to:count`.
///
/// # Errors
/// What is wrong with the text.
pub fn parse(text: &str) -> Result<Sweep, String> {
    let form = || "PATH=a,b,c or PATH=from:to:count, such as forearm.mass=1:3:5".to_string();
    let (path, values) = text.split_once('=').ok_or_else(form)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(form);
    let values = match values.split(':').collect::<Vec<_>>()[..] {
        [from, to, count] => {
            let (from, to) = (number(from)?, number(to)?);
            let count = count.trim().parse::<usize>().ok().filter(|n| (2..=10_000).contains(n));
            let count = count.ok_or("a sweep has 2 to 10000 values")?;
            (0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect()
        }
        _ => values.split(',').map(number).collect::<Result<Vec<f64>, String>>()?,
    };
    match path.contains('.') && !values.is_empty() {
        true => Ok(Sweep { path: path.trim().to_string(), values }),
        false => Err(form()),
    }
}

/// A parameter and the range in which its best value is looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterRange {
    /// `LINK.mass`, `JOINT.damping`, …
    pub path: String,
    /// From here to there, in the file's unit.
    pub ends: (f64, f64),
}

/// Reads `PATH=from:to`.
///
/// # Errors
/// What is wrong with the text.
pub fn parse_range(text: &str) -> Result<ParameterRange, String> {
    let form = || "PATH=from:to with from < to, such as elbow.spring_stiffness=0:50".to_string();
    let (path, ends) = text.split_once('=').ok_or_else(form)?;
    let (from, to) = ends.split_once(':').ok_or_else(form)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(form);
    let ends = (number(from)?, number(to)?);
    match path.contains('.') && ends.0 < ends.1 {
        true => Ok(ParameterRange { path: path.trim().to_string(), ends }),
        false => Err(form()),
    }
}

/// The robot file with another value of a parameter. A link's inertia grows with its mass, as of the same body in another density.
///
/// # Errors
/// The file has no such parameter.
pub fn with(description: &Description, path: &str, value: f64) -> Result<Description, Box<Diagnostic>> {
    let mut description = description.clone();
    let wrong = |why: String| Box::new(say::unknown_parameter(path, &why));
    let (owner, key) = path.rsplit_once('.').ok_or_else(|| wrong("there is no `.` in it".to_string()))?;
    let found = match key {
        "mass" => {
            let link = description.links.iter_mut().find(|link| link.name.value == owner);
            link.and_then(|link| link.inertial.as_mut()).map(|inertial| set_mass(inertial, value))
        }
        _ => {
            let joint = description.joints.iter_mut().find(|joint| joint.name.value == owner);
            joint.and_then(|joint| number(&mut joint.drive, key)).map(|number| number.value = value)
        }
    };
    match found {
        Some(()) => Ok(description),
        None => Err(wrong(format!("the robot file has no value `{key}` of `{owner}`"))),
    }
}

/// The robot file or the drives of a scene with another value of a parameter: [`with`], or a number of a drive ([`WrittenDrive::numbers`]). Where a
/// joint and a drive of one name both have it, it is the joint's.
///
/// # Errors
/// Neither has such a parameter, or a drive cannot have that value.
pub fn with_drives(
    description: &Description,
    of_scene: &[WrittenDrive],
    path: &str,
    value: f64,
) -> Result<(Description, Vec<WrittenDrive>), Box<Diagnostic>> {
    let complaint = match with(description, path, value) {
        Ok(changed) => return Ok((changed, of_scene.to_vec())),
        Err(complaint) => complaint,
    };
    let Some((owner, key)) = path.rsplit_once('.') else { return Err(complaint) };
    let (mut changed, mut of_scene) = (description.clone(), of_scene.to_vec());
    let mut drives = changed.drives.iter_mut().chain(&mut of_scene);
    let Some(drive) = drives.find(|drive| drive.name.value == owner) else { return Err(complaint) };
    match drive.set(key, value) {
        Some(Ok(())) => Ok((changed, of_scene)),
        Some(Err(be)) => Err(Box::new(say::not_in_range(path, value, be))),
        None => {
            let why = format!("drive `{owner}` has no value `{key}`");
            Err(Box::new(say::unknown_parameter(path, &why).help(format!("it has {}", drive.names().join(", ")))))
        }
    }
}

/// Whether a path names a number of a drive, and none of the robot's bodies and joints.
pub fn is_of_drive(description: &Description, of_scene: &[WrittenDrive], path: &str) -> bool {
    let Some((owner, _)) = path.rsplit_once('.') else { return false };
    let drives = description.drives.iter().chain(of_scene);
    with(description, path, 1.0).is_err() && drives.into_iter().any(|drive| drive.name.value == owner)
}

fn set_mass(WrittenInertial { mass, inertia, .. }: &mut WrittenInertial, value: f64) {
    let factor = if mass.value == 0.0 { 1.0 } else { value / mass.value };
    inertia.value = inertia.value.map(|x| x * factor);
    mass.value = value;
}

fn number<'a>(drive: &'a mut JointDrive, key: &str) -> Option<&'a mut Noted<f64>> {
    match key {
        "damping" => drive.damping.as_mut(),
        "friction" => drive.friction.as_mut(),
        "rotor_inertia" => drive.rotor_inertia.as_mut(),
        "gear_ratio" => drive.gear_ratio.as_mut(),
        "armature" => drive.armature.as_mut(),
        "spring_stiffness" => drive.spring_stiffness.as_mut(),
        "spring_rest" => drive.spring_rest.as_mut(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_a_list_or_a_range() {
        let values = |text: &str| parse(text).unwrap().values;
        assert_eq!(values("forearm.mass=1,2.5"), [1.0, 2.5]);
        assert_eq!(values("forearm.mass=1:3:5"), [1.0, 1.5, 2.0, 2.5, 3.0]);
        for text in ["forearm.mass", "mass=1", "a.mass=1,x", "a.mass=1:2:1", "a.mass=nan", "a.mass=1:2"] {
            assert!(parse(text).is_err(), "{text}");
        }
        assert_eq!(parse_range("a.mass=1:3").unwrap(), ParameterRange { path: "a.mass".to_string(), ends: (1.0, 3.0) });
        for text in ["a.mass=1", "a.mass=3:1", "a.mass=1:x", "mass=1:3"] {
            assert!(parse_range(text).is_err(), "{text}");
        }
    }
}
