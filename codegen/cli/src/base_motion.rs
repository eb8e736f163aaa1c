//! How a floating base moves, where messages of poses say it and those of joints do not: `nav_msgs/msg/Odometry`, or `tf2_msgs/msg/TFMessage`.

use straightline_core::model::{Joint, Model};
use straightline_core::spatial::{Transform, Vec3};
use straightline_logs::align::GAP;
use straightline_logs::log::{JointLog, LogQuantity};
use straightline_logs::mcap::LoggedPose;
use straightline_logs::LogError;
use straightline_view::ViewedPose;

/// Position and quaternion, and linear and angular velocity.
type PoseAndTwist = ([f64; 7], Option<[f64; 6]>);

/// A pose of the base, and its velocity where the message has one, in the base's own axes.
struct BaseState {
    time: f64,
    pose: [f64; 7],
    twist: Option<[f64; 6]>,
}

/// The base of a robot, if it floats and a log has no columns of it.
pub fn unlogged_base<'a>(model: &'a Model<f64>, log: &JointLog) -> Option<&'a Joint> {
    let base = model.joints().into_iter().find(|joint| joint.kind.is_base())?;
    let names = [0, 1].map(|order| base.entry_names(order)).concat();
    (!names.iter().any(|name| log.joints.contains(name))).then_some(base)
}

/// What is said where nothing tells how a base moves.
pub fn no_base(base: &Joint) -> LogError {
    let what = format!("no topic says how the base {} moves", base.name);
    let help = "it takes nav_msgs/msg/Odometry or tf2_msgs/msg/TFMessage whose child frame is a link of the base";
    LogError::new("", what, help)
}

/// Adds columns of the base to a log of joints: poses between two messages by straight lines, none in gaps and where no message is. Whether there are any.
///
/// # Errors
/// Several topics have poses of links that the base carries.
pub fn add_base(log: &mut JointLog, base: &Joint, model: &Model<f64>, poses: &[LoggedPose]) -> Result<bool, LogError> {
    let carried = |pose: &&LoggedPose| placement(model, pose);
    let mut topics: Vec<(bool, &str, &str)> = poses
        .iter()
        .filter(|pose| carried(pose).is_some())
        .map(|pose| (pose.twist.is_none(), &pose.topic[..], &pose.parent[..]))
        .collect();
    topics.sort_unstable();
    topics.dedup();
    // odometry, which has velocities, before frames
    topics.retain({
        let best = topics.first().map(|topic| topic.0);
        move |topic| Some(topic.0) == best
    });
    let (topic, parent) = match topics[..] {
        [(_, topic, parent)] => (topic.to_string(), parent),
        [] => return Ok(false),
        _ => {
            let named = |(_, topic, parent): &(bool, &str, &str)| format!("{topic} (in {parent})");
            let all: Vec<String> = topics.iter().map(named).collect();
            let what = format!("several topics say how the base {} moves: {}", base.name, all.join(", "));
            return Err(LogError::new("", what, "leave all but one out of the file"));
        }
    };
    let of_topic = || poses.iter().filter(|pose| pose.topic == topic && pose.parent == parent);
    // of several links of the base the one that it is named by, or whichever: they say the same
    let is_root = |pose: &&LoggedPose| carried(pose).is_some_and(|place| *place == Transform::identity());
    let links = || of_topic().filter(|pose| carried(pose).is_some());
    let Some(link) = links().find(is_root).or(links().next()).map(|pose| &pose.child) else { return Ok(false) };
    let own = of_topic().filter(|pose| pose.child == *link);
    let states: Vec<BaseState> = own.filter_map(|pose| Some(state(base, pose, carried(&pose)?, log.start))).collect();
    let states = in_order(states);
    let rows = between(&states, &log.times);
    let velocities = states.iter().all(|state| state.twist.is_some()).then_some(LogQuantity::Velocity);
    let position = |k: usize| rows.iter().map(|row| row.map_or(f64::NAN, |(pose, _)| pose[k])).collect::<Vec<f64>>();
    let velocity =
        |k: usize| rows.iter().map(|row| row.and_then(|(_, twist)| twist).map_or(f64::NAN, |twist| twist[k])).collect();
    for (k, name) in base.entry_names(0).into_iter().enumerate() {
        push(log, name, LogQuantity::Position, position(k));
    }
    for (k, name) in base.entry_names(1).into_iter().enumerate().filter(|_| velocities.is_some()) {
        push(log, name, LogQuantity::Velocity, velocity(k));
    }
    log.others.retain(|other| other.name != topic);
    Ok(true)
}

/// Where a link stands on the base, whose pose outside of the robot a message has.
fn placement<'a>(model: &'a Model<f64>, pose: &LoggedPose) -> Option<&'a Transform<f64>> {
    let is_of_the_robot = |name: &str| model.frame(name).is_some_and(|frame| frame.body.is_some());
    let frame = model.frame(&pose.child).filter(|_| !is_of_the_robot(&pose.parent))?;
    let body = &model.bodies[frame.body?];
    body.joint.kind.is_base().then_some(&frame.placement)
}

/// A column more.
fn push(log: &mut JointLog, name: String, quantity: LogQuantity, column: Vec<f64>) {
    log.joints.push(name);
    let count = log.joints.len();
    log.columns.iter_mut().for_each(|columns| columns.resize(count, Vec::new()));
    log.columns[quantity as usize][count - 1] = column;
}

/// The base as a message has a frame of it.
fn state(base: &Joint, pose: &LoggedPose, placement: &Transform<f64>, start: i64) -> BaseState {
    let mut frame = [&pose.translation[..], &pose.rotation].concat();
    base.kind.normalise(&mut frame);
    let ViewedPose { position, turn } = ViewedPose::from(&base.kind.motion(&frame).compose(&placement.inverse()));
    let twist = pose.twist.map(|[vx, vy, vz, wx, wy, wz]| {
        let turning = placement.rotation * Vec3::from([wx, wy, wz]);
        // of the base's origin, which is elsewhere
        let along = placement.rotation * Vec3::from([vx, vy, vz]) - turning.cross(placement.translation);
        let ([a, b, c], [d, e, f]) = (along.to_array(), turning.to_array());
        [a, b, c, d, e, f]
    });
    let ([x, y, z], [i, j, k, w]) = (position, turn);
    BaseState { time: pose.stamp.saturating_sub(start) as f64 * 1e-9, pose: [x, y, z, i, j, k, w], twist }
}

/// By time, one of each, with quaternions that do not jump to their opposites.
fn in_order(mut states: Vec<BaseState>) -> Vec<BaseState> {
    states.sort_by(|a, b| a.time.total_cmp(&b.time));
    states.dedup_by(|b, a| b.time == a.time);
    for k in 1..states.len() {
        let before = states[k - 1].pose;
        let now = &mut states[k].pose[3..];
        let along: f64 = now.iter().zip(&before[3..]).map(|(x, y)| x * y).sum();
        now.iter_mut().for_each(|x| *x *= 1f64.copysign(along));
    }
    states
}

/// Pose and twist at other times, by straight lines.
fn between(states: &[BaseState], times: &[f64]) -> Vec<Option<PoseAndTwist>> {
    let mut steps: Vec<f64> = states.windows(2).map(|pair| pair[1].time - pair[0].time).collect();
    steps.sort_by(f64::total_cmp);
    let longest = GAP * steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let at = |t: &f64| {
        let next = states.partition_point(|state| state.time <= *t);
        let before = states.get(next.checked_sub(1)?)?;
        if before.time == *t {
            return Some((before.pose, before.twist));
        }
        let after = states.get(next).filter(|after| after.time - before.time <= longest)?;
        let part = (t - before.time) / (after.time - before.time);
        let mix = |a: f64, b: f64| a + part * (b - a);
        let pose = std::array::from_fn(|k| mix(before.pose[k], after.pose[k]));
        let twist = before.twist.zip(after.twist).map(|(a, b)| std::array::from_fn(|k| mix(a[k], b[k])));
        Some((pose, twist))
    };
    times.iter().map(at).collect()
}
