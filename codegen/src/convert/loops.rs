//! Closed loops as every format can say them: by frames, with the joints that they determine.

use super::forms::RobotNames;
use crate::description::{Description, LoopPoints, NamedFrame, Noted, Rotation, WrittenLoop, WrittenPose};
use crate::model::geometry::point;
use straightline_core::closure::LoopEnd;
use straightline_core::model::{BodyId, Model};
use straightline_core::Dd;

/// The same loops of a robot whose model that is: two frames each, and joints by name.
pub fn by_frames(robot: &mut Description, model: &Model<Dd>) {
    let mut names = RobotNames::of(robot);
    let mut left: Vec<BodyId> = model.closure.dependents().collect();
    let mut spelled = Vec::new();
    for (written, closed) in robot.loops.iter().zip(&model.closure.loops) {
        let on_loop = model.bodies_of_loop(closed);
        let (own, others): (Vec<BodyId>, Vec<BodyId>) = left.iter().partition(|b| on_loop.contains(b));
        left = others;
        let joint = |b: &BodyId| Noted::assumed(model.bodies[*b].joint.name.clone());
        let frames = match &written.points {
            LoopPoints::Frames(frames) => frames.clone(),
            LoopPoints::Anchor { .. } => {
                let name = &written.name.value;
                let made = ["1", "2"].map(|end| Noted::assumed(names.links.made_up(&format!("{name}_{end}"))));
                for (name, end) in made.iter().zip(&closed.ends) {
                    spelled.push(at(name.clone(), end, robot, model));
                }
                made
            }
        };
        spelled.push(Spelled::Loop(WrittenLoop {
            name: written.name.clone(),
            points: LoopPoints::Frames(frames),
            determines: own.iter().map(joint).collect(),
            assembly: written.assembly.clone(),
            // in its plane a hinge is what its points are
            hinge: None,
        }));
    }
    robot.loops.clear();
    for item in spelled {
        match item {
            Spelled::Frame(frame) => robot.frames.push(frame),
            Spelled::Loop(own) => robot.loops.push(own),
        }
    }
}

enum Spelled {
    Frame(NamedFrame),
    Loop(WrittenLoop),
}

/// A frame at the end of a loop.
fn at(name: Noted<String>, end: &LoopEnd<Dd>, robot: &Description, model: &Model<Dd>) -> Spelled {
    let (link, position) = match end.body {
        Some(body) => {
            let body = &model.bodies[body];
            (body.name.clone(), point(&body.link_frame.inverse(), end.point))
        }
        None => (robot.root().map_or(String::new(), |root| root.name.value.clone()), end.point),
    };
    let xyz = Noted::assumed(position.to_array().map(Dd::to_f64));
    let pose = WrittenPose { xyz, rotation: Rotation::Turns(Vec::new()) };
    Spelled::Frame(NamedFrame { name, link: Noted::assumed(link), pose })
}
