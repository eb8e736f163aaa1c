//! New numbers in a robot file: everything else stays as it is written, and the robot is the one that was meant.

use std::path::{Path, PathBuf};
use straightline_codegen::convert::renumber::{renumbered, NewEffects, NewInertial, NewNumbers};
use straightline_codegen::description::{self, Rotation};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_core::spatial::Sym3;

const ARM: &str = r#"<?xml version="1.0"?>
<!-- an arm -- as written -->
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual>
    <inertial>
      <!-- weighed -->
      <origin rpy="0 0 1.5707963267948966" xyz="0.10 0 0"/>
      <mass value="2.50"/>
      <inertia ixx="0.010" ixy="0" ixz="0" iyy="0.020" iyz="0" izz="0.025"/>
    </inertial>
  </link>
  <link name="lower"><inertial><mass value="1"/></inertial></link>
  <joint name="shoulder" type="continuous">
    <parent link="base"/>
    <child link="upper"/>
    <axis xyz="0 1 0"/>
    <dynamics damping="0.5"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/>
    <child link="lower"/>
    <axis xyz="0 1 0"/>
  </joint>
</robot>
"#;

fn diagonal(xx: f64, yy: f64, zz: f64) -> Sym3<f64> {
    Sym3 { xx, xy: 0.0, xz: 0.0, yy, yz: 0.0, zz }
}

fn inertial(link: &str, mass: f64, com: [f64; 3], inertia: Sym3<f64>) -> NewInertial {
    NewInertial { link: link.to_string(), mass, com, inertia }
}

fn effects(joint: &str, damping: Option<f64>, friction: Option<f64>, rotor_inertia: Option<f64>) -> NewEffects {
    NewEffects { joint: joint.to_string(), damping, friction, rotor_inertia }
}

fn of(source: &Source, numbers: &NewNumbers) -> String {
    let mut said = Diagnostics::new();
    renumbered(source, numbers, &mut said).unwrap_or_else(|| panic!("{}: {said}", source.path()))
}

/// Lines of the second text that the first does not have.
fn new_lines<'a>(before: &str, after: &'a str) -> Vec<&'a str> {
    after.lines().filter(|line| !before.lines().any(|old| old == *line)).map(str::trim).collect()
}

#[test]
fn a_urdf_keeps_comments_meshes_and_digits() {
    let numbers = NewNumbers {
        links: vec![
            inertial("upper", 2.75, [0.1, 0.0, 0.0], diagonal(0.03, 0.01, 0.025)),
            inertial("lower", 1.0, [0.0, 0.0, 0.2], diagonal(0.001, 0.002, 0.003)),
        ],
        joints: vec![effects("shoulder", Some(0.5), Some(0.25), None), effects("elbow", Some(0.125), None, None)],
    };
    let text = of(&Source::new("arm.urdf", ARM), &numbers);
    let lines = new_lines(ARM, &text);
    assert_eq!(lines.len(), 7, "{text}");
    assert!(
        lines.contains(&r#"<mass value="2.75"/>"#) && lines.contains(&r#"<dynamics friction="0.25" damping="0.5"/>"#),
        "{text}"
    );
    // turned by a right angle about z, as the file has its axes; what is as it was keeps its digits
    let turned =
        lines.iter().find(|line| line.contains(r#"iyz="0" izz="0.025"/>"#)).unwrap_or_else(|| panic!("{text}"));
    assert!(turned.contains(r#"ixx="0.01"#) && turned.contains(r#"iyy="0.03"#), "{text}");
    assert!(lines.contains(&r#"<dynamics damping="0.125"/>"#) && text.contains(r#"xyz="0.10 0 0""#), "{text}");
    assert!(text.contains("<!-- weighed -->") && text.contains("package://arm/upper.stl"), "{text}");
    assert!(text.contains(r#"<origin xyz="0 0 0.2"/>"#) && text.contains(r#"<inertia ixx="0.001""#), "{text}");
}

#[test]
fn a_toml_keeps_comments_and_order() {
    let before = "# an arm\n[robot]\nname = \"arm\"\n[[link]]\nname = \"base\"\n[[link]]\nname = \"upper\"\nmass = 2.50 # weighed\ninertia = [0.1, 0.2, 0.2]\n\n[[joint]]\nname = \"shoulder\" # the first\nkind = \"continuous\"\nparent = \"base\"\nchild = \"upper\"\naxis = \"y\"\nrotor_inertia = 1e-4\ngear_ratio = 10\n";
    let numbers = NewNumbers {
        links: vec![inertial("upper", 3.0, [0.25, 0.0, 0.0], diagonal(0.1, 0.3, 0.3))],
        joints: vec![effects("shoulder", Some(0.75), None, Some(0.02))],
    };
    let after = of(&Source::new("arm.toml", before), &numbers);
    let wanted = before
        .replace("2.50 # weighed", "3 # weighed\ncom = [0.25, 0, 0]")
        .replace("[0.1, 0.2, 0.2]", "{ xx = 0.1, yy = 0.3, zz = 0.3 }")
        .replace("# the first", "# the first\ndamping = 0.75")
        .replace("1e-4", "0.0002");
    assert_eq!(after, wanted);
    // tables in braces
    let inline = "link = [{ name = \"base\" }, { name = \"upper\", mass = 2.5, inertia = [0.1, 0.2, 0.2] }]\n[robot]\nname = \"arm\"\n[[joint]]\nname = \"shoulder\"\nkind = \"continuous\"\nparent = \"base\"\nchild = \"upper\"\naxis = \"y\"\n";
    let numbers = NewNumbers { joints: Vec::new(), ..numbers };
    let after = of(&Source::new("arm.toml", inline), &numbers);
    assert!(after.contains("mass = 3, com = [0.25, 0, 0], inertia = { xx = 0.1, yy = 0.3, zz = 0.3 } }"), "{after}");
}

#[test]
fn what_a_format_cannot_say_is_refused() {
    let numbers = NewNumbers { joints: vec![effects("elbow", None, None, Some(0.02))], ..NewNumbers::default() };
    let mut said = Diagnostics::new();
    assert_eq!(renumbered(&Source::new("arm.urdf", ARM), &numbers, &mut said), None);
    assert!(said.to_string().contains("URDF has no place for rotors"), "{said}");
}

/// All robots of the repository: with their own numbers nothing changes, with others the robot is read as it was meant.
#[test]
fn robots_of_the_repository_keep_their_bytes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("robots").map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let mut seen = 0;
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a text");
        let source = Source::new(&path.display().to_string(), text.as_str());
        let robot = description::read(&source, &mut Diagnostics::new()).expect("a robot");
        if robot.format.write.is_none_or(|writer| writer.edits.is_none()) {
            continue;
        }
        seen += 1;
        let is_straight =
            |rotation: &Rotation| matches!(rotation, Rotation::RollPitchYaw(a) if a.iter().all(|a| a.value == 0.0));
        let links = robot.links.iter().filter_map(|link| Some((link, link.inertial.as_ref()?)));
        let links = links.filter(|(_, inertial)| is_straight(&inertial.rotation));
        let moving = robot.joints.iter().filter(|joint| joint.kind.value.kind.is_some());
        let own = |scale: f64| NewNumbers {
            links: links
                .clone()
                .map(|(link, i)| {
                    let com = i.com.value.map(|x| x * scale);
                    inertial(&link.name.value, i.mass.value * scale, com, i.inertia.value.map(|x| x * scale))
                })
                .collect(),
            joints: moving.clone().map(|j| effects(&j.name.value, Some((scale - 1.0) * 8.0), None, None)).collect(),
        };
        assert_eq!(of(&source, &NewNumbers { joints: Vec::new(), ..own(1.0) }), text, "{}", path.display());
        let scaled = of(&source, &own(1.25));
        let again =
            description::read(&Source::new(source.path(), scaled.as_str()), &mut Diagnostics::new()).expect("read");
        for (link, was) in links.clone() {
            let new = again.link(&link.name.value).and_then(|link| link.inertial.as_ref()).expect("it has an inertial");
            assert_eq!(new.mass.value, 1.25 * was.mass.value, "{}", path.display());
            assert_eq!(new.inertia.value, was.inertia.value.map(|x| x * 1.25), "{}", path.display());
        }
        for joint in again.joints.iter().filter(|joint| joint.kind.value.kind.is_some()) {
            assert_eq!(joint.drive.damping.as_ref().map(|damping| damping.value), Some(2.0), "{}", path.display());
        }
    }
    assert!(seen >= 6, "{seen} robots");
}
