//! Sliders write masses and lengths into the robot file.

use super::support::{natively, robot, robots};
use serde_json::json;
use std::collections::BTreeMap;
use straightline_codegen::description::{self, Placement, WrittenJoint};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_playground::edits::{editables, with_factors, Factors};

#[test]
fn every_robot_has_masses_and_lengths_that_can_be_changed() {
    for (name, text) in robots() {
        let found = editables(&Source::new(&name, text));
        println!("{name}: {} masses, {} lengths", found.masses.len(), found.lengths.len());
        assert!(!found.masses.is_empty(), "{name}");
        // the chapter's own notation gives vectors between joints, which are no placements
        assert!(!found.lengths.is_empty() || name.starts_with("chapter_"), "{name}");
    }
}

#[test]
fn a_factor_changes_its_number_and_nothing_else() {
    for (name, link, joint) in [("ur5.urdf", "forearm_link", "elbow_joint"), ("planar_2r.toml", "link2", "joint2")] {
        let source = Source::new(name, robot(name));
        let factors = Factors {
            masses: BTreeMap::from([(link.to_string(), 2.0)]),
            lengths: BTreeMap::from([(joint.to_string(), 0.5)]),
        };
        let [before, after] = [source.clone(), with_factors(&source, &factors)]
            .map(|source| description::read(&source, &mut Diagnostics::new()).unwrap());
        for (was, is) in before.links.iter().zip(&after.links) {
            let (Some(was_inertial), Some(is_inertial)) = (&was.inertial, &is.inertial) else { continue };
            let factor = if was.name.value == link { 2.0 } else { 1.0 };
            assert_eq!(is_inertial.mass.value, factor * was_inertial.mass.value, "{}", was.name.value);
            assert_eq!(is_inertial.inertia.value.yy, factor * was_inertial.inertia.value.yy, "{}", was.name.value);
            assert_eq!(is_inertial.com, was_inertial.com);
        }
        let at = |joint: &WrittenJoint| match &joint.placement {
            Placement::Frames { origin, axis } => (origin.xyz.value, axis.value),
            other => panic!("{other:?}"),
        };
        let differ = before.joints.iter().zip(&after.joints).filter(|(was, is)| at(was) != at(is));
        assert_eq!(differ.map(|(was, _)| was.name.value.as_str()).collect::<Vec<_>>(), [joint]);
        // nothing to change leaves the very text
        assert_eq!(with_factors(&source, &Factors::default()).text(), source.text());
    }
}

#[test]
fn factors_that_mean_nothing_are_left_out() {
    let text = robot("ur5.urdf");
    let request = json!({ "name": "ur5.urdf", "text": text, "factors": { "masses": { "nobody": 2.0, "forearm_link": -1.0 }, "lengths": { "elbow_joint": 0.0 } } });
    assert_eq!(natively("bench", &request)["text"].as_str(), Some(&*text));
}
