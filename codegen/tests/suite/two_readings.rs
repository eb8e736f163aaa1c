//! Two readings of a robot file, one physics: the model with the algorithms, and the reference's own reading with the
//! reference, agree in double-double on random robots in all notations.

use crate::compare::{compare_authors, Disagreement};
use crate::robots::Random;
use crate::written::{Shape, Style, Written};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, PI};
use std::fmt::Write;
use straightline_codegen::description;
use straightline_codegen::description::flexible::{BaseSupport, Bending, Flexible, WrittenSpring};
use straightline_codegen::description::Noted;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{self, FrameOption, ModelOptions};
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::model::JointEffects;

/// A joint of a random robot in joint frames; joint j moves link j + 1.
pub(crate) struct RandomJoint {
    kind: &'static str,
    parent: usize,
    xyz: [f64; 3],
    rpy: [f64; 3],
    axis: [f64; 3],
}

pub(crate) struct RandomLink {
    mass: f64,
    com: [f64; 3],
    rpy: [f64; 3],
    /// xx, yy, zz, xy, xz, yz
    inertia: [f64; 6],
}

pub(crate) struct RandomRobot {
    /// `None`: the file gives no inertia.
    links: Vec<Option<RandomLink>>,
    joints: Vec<RandomJoint>,
}

fn triple(random: &mut Random, size: f64) -> [f64; 3] {
    [0; 3].map(|_| random.number().to_f64() * size)
}

/// An angle as robot files have it: often right, in different roundings, sometimes any.
fn angle(random: &mut Random) -> f64 {
    // right angles to the last digit, and one with eight digits
    const USUAL: [f64; 7] = [0.0, FRAC_PI_2, -FRAC_PI_2, PI, FRAC_PI_4, -FRAC_PI_6, FRAC_PI_2 - 2.7e-8];
    match random.below(10) {
        i if i < USUAL.len() => USUAL[i],
        _ => random.number().to_f64() * 3.0,
    }
}

fn axis(random: &mut Random) -> [f64; 3] {
    match random.below(5) {
        0 => [1.0, 0.0, 0.0],
        1 => [0.0, -1.0, 0.0],
        2 => [0.0, 0.0, 1.0],
        _ => random.direction().map(|x| (x + x).to_f64()).into(), // oblique, and not of unit length
    }
}

fn random_link(random: &mut Random) -> RandomLink {
    let mass = random.between(0.2, 5.0);
    let tensor = random.inertia(mass).map(|x| x.to_f64());
    RandomLink {
        mass: mass.to_f64(),
        com: triple(random, 0.3),
        rpy: [0; 3].map(|_| angle(random)),
        inertia: [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| tensor[at]),
    }
}

pub(crate) fn random_robot(random: &mut Random, links: usize, floating: bool) -> RandomRobot {
    let mut robot = RandomRobot { links: Vec::new(), joints: Vec::new() };
    // the root of a fixed robot is the world: often without inertia
    robot.links.push((floating || random.below(2) == 0).then(|| random_link(random)));
    for j in 1..links {
        let kind =
            if j == 1 { "continuous" } else { ["fixed", "revolute", "continuous", "prismatic"][random.below(4)] };
        robot.joints.push(RandomJoint {
            kind,
            parent: if random.below(2) == 0 { j - 1 } else { random.below(j) },
            xyz: triple(random, 0.5),
            rpy: [0; 3].map(|_| angle(random)),
            axis: axis(random),
        });
        let has_inertia = kind != "fixed" || random.below(2) == 0;
        robot.links.push(has_inertia.then(|| random_link(random)));
    }
    robot
}

fn words(v: &[f64; 3]) -> String {
    format!("{:?} {:?} {:?}", v[0], v[1], v[2])
}

pub(crate) fn urdf(random: &mut Random, robot: &RandomRobot) -> String {
    let mut elements = Vec::new();
    for (j, link) in robot.links.iter().enumerate() {
        let inertial = link.as_ref().map_or_else(String::new, |link| {
            let [xx, yy, zz, xy, xz, yz] = link.inertia;
            format!(
                "<inertial><origin rpy='{}' xyz='{}'/><mass value='{:?}'/><inertia ixx='{xx:?}' iyy='{yy:?}' \
                 izz='{zz:?}' ixy='{xy:?}' ixz='{xz:?}' iyz='{yz:?}'/></inertial>",
                words(&link.rpy),
                words(&link.com),
                link.mass,
            )
        });
        elements.push(format!("<link name='link{j}'>{inertial}</link>"));
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        elements.push(format!(
            "<joint name='joint{j}' type='{}'><parent link='link{}'/><child link='link{}'/><origin xyz='{}' \
             rpy='{}'/><axis xyz='{}'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>",
            joint.kind,
            joint.parent,
            j + 1,
            words(&joint.xyz),
            words(&joint.rpy),
            words(&joint.axis),
        ));
    }
    // elements in any order
    for i in (1..elements.len()).rev() {
        elements.swap(i, random.below(i + 1));
    }
    format!("<?xml version='1.0'?>\n<robot name='random'>\n{}\n</robot>\n", elements.join("\n"))
}

/// The three angles in one of the units: key and values. Other units are other angles, which is as good.
fn toml_angles(random: &mut Random, stem: &str, rpy: &[f64; 3]) -> String {
    let unit = ["", "_rad", "_deg", "_quarter_turns", "_turns"][random.below(5)];
    let values = match unit {
        "_deg" => rpy.map(|x| x.to_degrees().round()),
        "_quarter_turns" | "_turns" => rpy.map(|x| (x * 6.0).round() / 4.0),
        _ => *rpy,
    };
    format!("{stem}{unit} = {values:?}")
}

pub(crate) fn joint_frame_toml(random: &mut Random, robot: &RandomRobot, floating: bool) -> String {
    let base = if floating { "base = \"floating\"\n" } else { "" };
    let mut text = format!("[robot]\nname = \"random\"\ngravity = {:?}\n{base}", triple(random, 9.0));
    for (j, link) in robot.links.iter().enumerate() {
        writeln!(text, "[[link]]\nname = \"link{j}\"").unwrap();
        if let Some(link) = link {
            let [xx, yy, zz, xy, xz, yz] = link.inertia;
            let rpy = toml_angles(random, "inertia_rpy", &link.rpy);
            writeln!(text, "mass = {:?}\ncom = {:?}\n{rpy}", link.mass, link.com).unwrap();
            writeln!(text, "inertia = [[{xx:?}, {xy:?}, {xz:?}], [{xy:?}, {yy:?}, {yz:?}], [{xz:?}, {yz:?}, {zz:?}]]")
                .unwrap();
        }
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        let RandomJoint { kind, parent, xyz, rpy, axis } = joint;
        let rpy = toml_angles(random, "rpy", rpy);
        writeln!(text, "[[joint]]\nname = \"joint{j}\"\nkind = \"{kind}\"\nparent = \"link{parent}\"").unwrap();
        writeln!(text, "child = \"link{}\"\naxis = {axis:?}\norigin = {{ xyz = {xyz:?}, {rpy} }}", j + 1).unwrap();
        writeln!(text, "limits = [-1.0, 1.0]").unwrap();
    }
    let rpy = [0; 3].map(|_| angle(random));
    let rpy = toml_angles(random, "rpy", &rpy);
    let xyz = triple(random, 1.0);
    writeln!(text, "[[frame]]\nname = \"tool\"\nlink = \"link{}\"\nxyz = {xyz:?}\n{rpy}", robot.joints.len()).unwrap();
    text
}

/// The upper end of a link: e_next, r_next, and in a specificity r_next_star.
fn upper_end(random: &mut Random) -> String {
    let e: [f64; 3] = random.direction().map(|x| x.to_f64()).into();
    if random.below(3) == 0 {
        let along = random.number().to_f64();
        format!("e_next = {e:?}\nr_next = {:?}\nr_next_star = {:?}\n", e.map(|x| x * along), triple(random, 1.0))
    } else {
        format!("e_next = {e:?}\nr_next = {:?}\n", triple(random, 0.5))
    }
}

pub(crate) fn chapter_toml(random: &mut Random, links: usize) -> String {
    let mut text = format!("name = \"random\"\ngravity = {:?}\n[base]\n{}", triple(random, 9.0), upper_end(random));
    for j in 0..links {
        let RandomLink { mass, com: r, inertia: [xx, yy, zz, xy, xz, yz], .. } = random_link(random);
        let linear = random.below(3) == 0;
        let kind = if linear { "linear" } else { "revolute" };
        writeln!(text, "[[link]]\ntype = \"{kind}\"\nmass = {mass:?}").unwrap();
        writeln!(text, "J = [[{xx:?}, {xy:?}, {xz:?}], [{xy:?}, {yy:?}, {yz:?}], [{xz:?}, {yz:?}, {zz:?}]]").unwrap();
        let e: [f64; 3] = random.direction().map(|x| x.to_f64()).into();
        if random.below(3) == 0 {
            let along = random.number().to_f64();
            writeln!(text, "e = {e:?}\nr = {:?}\nr_star = {:?}", e.map(|x| x * along), triple(random, 1.0)).unwrap();
        } else {
            writeln!(text, "e = {e:?}\nr = {r:?}").unwrap();
        }
        if linear {
            writeln!(text, "alpha = {:?}", angle(random)).unwrap();
        }
        if j + 1 < links {
            text += &upper_end(random);
        } else {
            writeln!(text, "r_next = {:?}", triple(random, 0.5)).unwrap();
        }
    }
    text
}

fn random_options(random: &mut Random, joints: Vec<String>, floating: bool) -> ModelOptions {
    let mut options = ModelOptions { floating_base: floating, ..ModelOptions::default() };
    options.angle_tolerance = [0.0, options.angle_tolerance, 1e-6][random.below(3)];
    if random.below(3) == 0 {
        options.gravity = Some(triple(random, 9.0));
    }
    if random.below(3) == 0 {
        let mut order = joints;
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i + 1));
        }
        options.joint_order = Some(order);
    }
    let rpy = [angle(random), angle(random), angle(random)];
    options.frames =
        vec![FrameOption { name: "probe".to_string(), link: "link1".to_string(), xyz: [0.1, -0.2, 0.3], rpy }];
    options
}

fn random_support(random: &mut Random) -> BaseSupport {
    let spring = WrittenSpring { stiffness: Noted::assumed(1e4), damping: Noted::assumed(1.0), rest: 0.0 };
    let directions = std::array::from_fn(|k| (k == 2 || random.below(2) == 0).then(|| spring.clone()));
    BaseSupport { at: triple(random, 0.3), directions, place: Noted::assumed(()) }
}

fn compare_file(
    disagreement: &mut Disagreement,
    robot: &str,
    text: String,
    options: &ModelOptions,
    random: &mut Random,
) {
    compare_source(disagreement, robot, &Source::new(robot, text), options, random);
}

pub(crate) fn compare_source(
    disagreement: &mut Disagreement,
    robot: &str,
    source: &Source,
    options: &ModelOptions,
    random: &mut Random,
) {
    let (model, diagnostics) = model::load(source, options);
    let mut model = model.unwrap_or_else(|| panic!("{}\n{}", diagnostics.render(), source.text()));
    // friction is no part of this comparison
    model.bodies.iter_mut().for_each(|body| body.effects = JointEffects::none());
    let description = description::read(source, &mut Diagnostics::new()).expect("the file was read before");
    let tree = centre_of_mass_tree(&description, options).expect("the file describes a tree");
    compare_authors(disagreement, robot, &tree, &model, random);
}

fn moving_joints(robot: &RandomRobot) -> Vec<String> {
    let moving = robot.joints.iter().enumerate().filter(|(_, joint)| joint.kind != "fixed");
    moving.map(|(j, _)| format!("joint{j}")).collect()
}

#[test]
fn both_readings_of_random_urdf_agree() {
    let mut disagreement = Disagreement::default();
    for seed in 0..60 {
        let mut random = Random(seed);
        let (links, floating) = (2 + random.below(12), random.below(2) == 0);
        let robot = random_robot(&mut random, links, floating);
        let options = random_options(&mut random, moving_joints(&robot), floating);
        let text = urdf(&mut random, &robot);
        compare_file(&mut disagreement, &format!("urdf, seed {seed}"), text, &options, &mut random);
    }
    disagreement.judge();
}

/// Few digits, right angles cut anywhere, dust, masses and units of every size.
#[test]
fn both_readings_of_robots_as_people_write_them_agree() {
    let mut disagreement = Disagreement::default();
    for (seed, style) in (0..3).flat_map(|k| Style::all().into_iter().map(move |style| (k, style))) {
        let shape = Shape::any(&mut crate::written::Random(seed), 7);
        let robot = Written::new(style, shape, 100 + seed);
        let mut random = Random(seed);
        let mut options = random_options(&mut random, Vec::new(), robot.floating);
        (options.joint_order, options.frames[0].link) = (None, "l1".to_string());
        let name = format!("{}, seed {seed}", style.name());
        let source = Source::new(robot.file_name(), robot.text());
        compare_source(&mut disagreement, &name, &source, &options, &mut random);
    }
    disagreement.judge();
}

#[test]
fn both_readings_of_random_joint_frame_toml_agree() {
    let mut disagreement = Disagreement::default();
    for seed in 0..60 {
        let mut random = Random(seed);
        let (links, floating) = (2 + random.below(12), random.below(2) == 0);
        let robot = random_robot(&mut random, links, floating);
        let options = random_options(&mut random, moving_joints(&robot), false);
        let text = joint_frame_toml(&mut random, &robot, floating);
        compare_file(&mut disagreement, &format!("toml, seed {seed}"), text, &options, &mut random);
    }
    disagreement.judge();
}

#[test]
fn both_readings_of_frames_in_frames_agree() {
    let mut disagreement = Disagreement::default();
    for (name, text) in [("arm.sdf", include_str!("../files/arm.sdf")), ("dh.toml", include_str!("../files/dh.toml"))] {
        let options = ModelOptions { uncoupled: true, ..ModelOptions::default() };
        compare_source(&mut disagreement, name, &Source::new(name, text), &options, &mut Random(3));
    }
    disagreement.judge();
}

#[test]
fn both_readings_of_random_centre_of_mass_toml_agree() {
    let mut disagreement = Disagreement::default();
    for seed in 0..60 {
        let mut random = Random(seed);
        let links = 1 + random.below(9);
        let text = chapter_toml(&mut random, links);
        let joints = (1..=links).map(|j| format!("joint{j}")).collect();
        let mut options = random_options(&mut random, joints, false);
        // on springs, or with a frame on the end of the chain
        match seed % 3 {
            0 => (options.support, options.joint_order) = (Some(random_support(&mut random)), None),
            1 => options.frames[0].link = "tip".to_string(),
            _ => {}
        }
        compare_file(&mut disagreement, &format!("chapter, seed {seed}"), text, &options, &mut random);
    }
    disagreement.judge();
}

/// Flexible links of any direction in random robots, and supports below them: rigid bodies as the reference cuts them.
#[test]
fn both_readings_of_flexible_links_and_supports_agree() {
    let mut disagreement = Disagreement::default();
    let mut cuts = 0;
    for seed in 0..40 {
        let mut random = Random(seed);
        let links = 2 + random.below(6);
        let robot = random_robot(&mut random, links, true);
        let mut options = random_options(&mut random, Vec::new(), false);
        options.joint_order = None;
        options.rigid_links = seed == 0;
        for j in 1..links {
            if random.below(2) == 0 || robot.links[j].is_none() {
                continue;
            }
            let (oblique, stiffness) = (triple(&mut random, 0.1), Noted::assumed(10.0));
            let along_x = [0.05 + 0.2 * oblique[0].abs(), 0.0, 0.0];
            let (bending, torsion, from, to) = match random.below(3) {
                0 => (Bending::Round(stiffness), None, [0.0; 3], along_x),
                1 => (Bending::About([None, Some(stiffness), None]), None, [-0.01, 0.0, 0.0], along_x),
                _ => (Bending::None, Some(stiffness), [0.0; 3], oblique),
            };
            options.flexible.push(Flexible {
                link: Noted::assumed(format!("link{j}")),
                from,
                to: Noted::assumed(to),
                segments: Noted::assumed(1 + random.below(3)),
                bending,
                torsion,
                damping: Noted::assumed(0.0),
            });
        }
        if random.below(2) == 0 {
            options.support = Some(random_support(&mut random));
        }
        let text = urdf(&mut random, &robot);
        let source = Source::new("flexible.urdf", text.clone());
        let (model, diagnostics) = model::load(&source, &options);
        let mut model = model.unwrap_or_else(|| panic!("seed {seed}: {}\n{text}", diagnostics.render()));
        if diagnostics.iter().any(|d| d.code == "singular-joint") {
            continue; // a segment that the link's mass does not reach
        }
        cuts += model.bodies.iter().filter(|b| b.effects.stiffness.to_f64() != 0.0).count();
        // what springs add is no part of this comparison
        model.bodies.iter_mut().for_each(|body| body.effects = JointEffects::none());
        let description = description::read(&source, &mut Diagnostics::new()).expect("the file was read before");
        let tree = centre_of_mass_tree(&description, &options).expect("the file describes a tree");
        compare_authors(&mut disagreement, &format!("flexible, seed {seed}"), &tree, &model, &mut random);
    }
    assert!(cuts > 60, "only {cuts} elastic joints");
    disagreement.judge();
}
