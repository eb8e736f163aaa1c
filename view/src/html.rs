//! The page: numbers of a run as JSON, and the script that draws them, in one file that asks for nothing else.
//!
//! Nothing of a robot's file or of a run is HTML: all of it stands in one element of JSON, in which no `<` is written as such, and comes into the
//! document as text. What the page may do is told to the browser by hashes of its own script and style: it runs and loads nothing else.

use crate::charts::{arrows, charts, ViewArrow, ViewChart};
use crate::ellipsoid::inertia_ellipsoid;
use crate::poses::{world_poses, world_transforms, ViewedPose};
use crate::run::{ViewFailure, ViewedRun};
use crate::shapes::{ShapeForm, ViewedLook, ViewedShape};
use crate::solids::{extent, limbs, reach, Limb};
use base64::{engine::general_purpose::STANDARD, Engine};
use serde::Serialize;
use sha2::{Digest, Sha256};
use straightline_core::model::{Body, Model};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_core::trig::DOMAIN_F64;

/// The angle between the upper and the lower edge of the picture \[rad\].
pub const FIELD_OF_VIEW: f64 = 0.6;
/// Numbers of the motion take this many characters at most \[bytes\]; longer runs are thinned.
const MOST_BYTES: usize = 300_000;
/// But not to fewer rows.
const FEWEST_ROWS: usize = 60;
/// Nor does a screen show more.
const MOST_ROWS: usize = 1500;

const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = concat!(
    "\"use strict\";\n",
    include_str!("page/algebra.js"),
    include_str!("page/scene.js"),
    include_str!("page/charts.js"),
    include_str!("page/page.js"),
);
const BODY: &str = include_str!("page/page.html");

#[derive(Serialize)]
struct PageData<'a> {
    title: &'a str,
    facts: &'a [(&'a str, String)],
    notes: Vec<String>,
    camera: Camera,
    /// Height of the ground along the upward axis \[m\].
    ground: f32,
    /// How far the robot reaches \[m\].
    reach: f32,
    /// The body that floats.
    base: Option<usize>,
    world: PageLimb,
    bodies: Vec<PageBody<'a>>,
    frames: Vec<PageFrame<'a>>,
    shapes: Vec<PageShape>,
    charts: Vec<ViewChart>,
    arrows: Vec<ViewArrow>,
    rows: usize,
    /// Base64 of little-endian f64, one per row.
    times: String,
    /// Base64 of little-endian f32: row by row, body by body position and quaternion x, y, z, w.
    poses: String,
    /// Base64 of little-endian f32, one per row.
    columns: Vec<String>,
}

#[derive(Serialize)]
struct Camera {
    /// Directions of the world: azimuth is counted from the first to the second; the third is up.
    axes: [[f32; 3]; 3],
    target: [f32; 3],
    distance: f32,
    azimuth: f32,
    elevation: f32,
    field_of_view: f32,
}

#[derive(Serialize)]
struct PageLimb {
    ends: Vec<[f32; 3]>,
    radius: f32,
}

#[derive(Serialize)]
struct PageBody<'a> {
    name: &'a str,
    parent: Option<usize>,
    joint: &'a str,
    /// What stands for the joint: "turn", "slide", "ball" or "base".
    kind: &'static str,
    /// Where the joint stands in the parent \[m\].
    home: [f32; 3],
    /// Index of the joint's colour.
    colour: usize,
    limb: PageLimb,
    ellipsoid: Option<PageEllipsoid>,
    /// The axes in which forces that the joint carries are given: quaternion in the canonical frame.
    link_turn: [f32; 4],
}

#[derive(Serialize)]
struct PageEllipsoid {
    center: [f32; 3],
    turn: [f32; 4],
    semi_axes: [f32; 3],
}

#[derive(Serialize)]
struct PageFrame<'a> {
    name: &'a str,
    body: Option<usize>,
    pose: [f32; 7],
}

#[derive(Serialize)]
struct PageShape {
    body: Option<usize>,
    pose: [f32; 7],
    /// "box", "cylinder", "sphere", or "mesh".
    form: &'static str,
    /// By what the unit solid is scaled along its axes.
    size: [f32; 3],
    colour: Option<[f32; 4]>,
    /// Base64 of little-endian f32, nine per triangle; empty of other solids.
    triangles: String,
}

fn single<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|x| x as f32)
}

fn encoded(numbers: impl Iterator<Item = f32>) -> String {
    STANDARD.encode(numbers.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
}

fn page_limb(limb: &Limb) -> PageLimb {
    PageLimb { ends: limb.ends.iter().map(|end| single(end.to_array())).collect(), radius: limb.radius as f32 }
}

fn page_shape(shape: &ViewedShape) -> PageShape {
    let (form, size, triangles) = match &shape.form {
        ShapeForm::Box(edges) => ("box", *edges, String::new()),
        ShapeForm::Cylinder { radius, length } => ("cylinder", [*radius, *radius, *length], String::new()),
        ShapeForm::Sphere(radius) => ("sphere", [*radius; 3], String::new()),
        ShapeForm::Mesh(triangles, scale) => ("mesh", *scale, encoded(triangles.iter().flatten().flatten().copied())),
    };
    let pose = ViewedPose::from(&shape.placement).in_single_precision();
    PageShape { body: shape.body, pose, form, size: single(size), colour: shape.colour.map(single), triangles }
}

/// The page of a robot's run: its whole text, the same bytes for the same input. `facts` stand below the title, each with its
/// name; a robot whose looks are not known is drawn by capsules.
///
/// # Errors
/// All that is wrong with the run: no row, numbers that are not finite, columns of other lengths, times that go back,
/// angles and numbers that single precision does not hold.
pub fn page(
    model: &Model<f64>,
    look: &ViewedLook,
    run: &ViewedRun,
    facts: &[(&str, String)],
) -> Result<String, Vec<ViewFailure>> {
    let failures = run.check(model);
    if !failures.is_empty() {
        return Err(failures);
    }
    let rows = shown_rows(model, run);
    let failures = undrawable(model, run, &rows);
    if !failures.is_empty() {
        return Err(failures);
    }
    let mut data = data(model, run, &rows, facts);
    data.shapes = look.shapes.iter().map(page_shape).collect();
    data.notes.extend(look.notes.iter().cloned());
    let json = serde_json::to_string(&data).expect("it holds texts and numbers only");
    // JSON has these characters in texts alone, where they can be written so; no text ends the element then
    let json = json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026");
    let hash = |text: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text.as_bytes())));
    let policy = format!(
        "default-src 'none'; script-src {}; style-src {}; base-uri 'none'; form-action 'none'",
        hash(SCRIPT),
        hash(STYLE)
    );
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>Straightline: a robot in motion</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n{BODY}\
         <script type=\"application/json\" id=\"data\">{json}</script>\n<script>{SCRIPT}</script>\n</body>\n</html>\n"
    ))
}

/// What single precision does not hold: the first pose of such a body, and the first such number of each column.
fn undrawable(model: &Model<f64>, run: &ViewedRun, rows: &[usize]) -> Vec<ViewFailure> {
    let is_fine = |x: f64| (x as f32).is_finite();
    let is_lost = |pose: &ViewedPose| !pose.in_single_precision().iter().all(|x| x.is_finite());
    let lost = rows.iter().find_map(|row| {
        let body = world_poses(model, &run.configurations[*row]).iter().position(is_lost)?;
        Some((run.times[*row], &model.bodies[body]))
    });
    let mut failures: Vec<ViewFailure> = Vec::new();
    if let Some((t, body)) = lost {
        let what = format!("at t = {t:?} s the pose of {} is no number that can be drawn", body.name);
        let help = format!("look at {}: angles stay within ±{DOMAIN_F64} rad", body.joint.name);
        failures.push(ViewFailure { what, help });
    }
    for (name, column) in &run.columns {
        if let Some(row) = rows.iter().find(|row| !is_fine(column[**row])) {
            let what =
                format!("at t = {:?} s `{name}` is {:e}, which cannot be plotted", run.times[*row], column[*row]);
            failures.push(ViewFailure { what, help: format!("numbers stay within ±{:e}", f32::MAX) });
        }
    }
    failures
}

/// How many rows a page shows at most, of so many bodies and columns.
pub(crate) fn most_rows(bodies: usize, columns: usize) -> usize {
    // three bytes are four characters; a time is a number of 8 bytes
    let bytes = (4 * (7 * bodies + columns) + 8) * 4 / 3;
    (MOST_BYTES / bytes).clamp(FEWEST_ROWS, MOST_ROWS)
}

/// The rows that are shown: all, or so many that the page stays small, in equal steps of time as near as there are rows.
fn shown_rows(model: &Model<f64>, run: &ViewedRun) -> Vec<usize> {
    let rows = run.times.len();
    let most = most_rows(model.bodies.len(), run.columns.len());
    if rows <= most {
        return (0..rows).collect();
    }
    let (first, last) = (run.times[0], run.times[rows - 1]);
    let nearest = |k: usize| {
        let t = first + (last - first) * k as f64 / (most - 1) as f64;
        let after = run.times.partition_point(|time| *time < t).min(rows - 1);
        if after > 0 && t - run.times[after - 1] < run.times[after] - t {
            after - 1
        } else {
            after
        }
    };
    let mut shown: Vec<usize> = (0..most).map(nearest).collect();
    shown.dedup();
    shown
}

fn data<'a>(model: &'a Model<f64>, run: &ViewedRun, rows: &[usize], facts: &'a [(&str, String)]) -> PageData<'a> {
    let reach = reach(model, &run.configurations[0]);
    let limbs = limbs(model, reach);
    let (camera, ground) = camera(model, run, rows, &limbs);
    let mut notes = run.notes.clone();
    if rows.len() < run.times.len() {
        let (shown, all) = (rows.len(), run.times.len());
        notes.push(format!("{shown} of {all} rows of the run are shown; peaks between them are not seen."));
    }
    let poses = rows.iter().flat_map(|row| world_poses(model, &run.configurations[*row]));
    let poses = encoded(poses.flat_map(|pose| pose.in_single_precision()));
    let columns = run.columns.iter().map(|(_, column)| encoded(rows.iter().map(|row| column[*row] as f32))).collect();
    let times: Vec<u8> = rows.iter().flat_map(|row| run.times[*row].to_le_bytes()).collect();
    PageData {
        title: &model.name,
        facts,
        notes,
        camera,
        ground: ground as f32,
        reach: reach as f32,
        base: base(model),
        world: page_limb(&limbs[0]),
        bodies: bodies(model, &limbs[1..]),
        frames: frames(model),
        shapes: Vec::new(),
        charts: charts(model, &run.columns),
        arrows: arrows(model, &run.columns),
        rows: rows.len(),
        times: STANDARD.encode(times),
        poses,
        columns,
    }
}

fn bodies<'a>(model: &'a Model<f64>, limbs: &[Limb]) -> Vec<PageBody<'a>> {
    let order: Vec<&str> = model.tree_joints().iter().map(|joint| joint.name.as_str()).collect();
    let of = |(body, limb): (&'a Body<f64>, &Limb)| PageBody {
        name: &body.name,
        parent: body.parent,
        joint: &body.joint.name,
        kind: match body.joint.kind {
            kind if kind.is_base() => "base",
            kind if kind.slides() => "slide",
            kind if kind.row().has_axis => "turn",
            _ => "ball",
        },
        home: single(body.placement.translation.to_array()),
        colour: order.iter().position(|name| *name == body.joint.name).unwrap_or(0),
        limb: page_limb(limb),
        ellipsoid: inertia_ellipsoid(body).map(|e| PageEllipsoid {
            center: single(e.center),
            turn: single(e.turn),
            semi_axes: single(e.semi_axes),
        }),
        link_turn: single(ViewedPose::from(&body.link_frame).turn),
    };
    model.bodies.iter().zip(limbs).map(of).collect()
}

/// The robot's frames, or where it names none those of its joints.
fn frames(model: &Model<f64>) -> Vec<PageFrame<'_>> {
    let pose = |of: &Transform<f64>| ViewedPose::from(of).in_single_precision();
    if model.frames.is_empty() {
        let of = |(k, body): (usize, &'_ Body<f64>)| (k, pose(&body.link_frame));
        let frames = model.bodies.iter().enumerate().map(of).zip(&model.bodies);
        return frames.map(|((k, pose), body)| PageFrame { name: &body.name, body: Some(k), pose }).collect();
    }
    let frames = model.frames.iter();
    frames.map(|frame| PageFrame { name: &frame.name, body: frame.body, pose: pose(&frame.placement) }).collect()
}

/// The body of a floating base.
fn base(model: &Model<f64>) -> Option<usize> {
    model.bodies.iter().position(|body| body.joint.kind.is_base())
}

/// Directions of the world as the page has them: the axis that gravity points against most is up, and z without gravity.
fn directions(gravity: Vec3<f64>) -> [Vec3<f64>; 3] {
    let up = gravity.to_array().map(|x| -x);
    let longest = (0..3).rev().fold(2, |best, k| if up[k].abs() > up[best].abs() { k } else { best });
    let sign = if up[longest] < 0.0 { -1.0 } else { 1.0 };
    let up = Vec3::unit(longest).scale(sign);
    let first = Vec3::unit((longest + 1) % 3);
    [first, up.cross(first), up]
}

/// The camera that sees the whole motion, and the height of the ground.
fn camera(model: &Model<f64>, run: &ViewedRun, rows: &[usize], limbs: &[Limb]) -> (Camera, f64) {
    let axes = directions(model.gravity);
    let along = |p: Vec3<f64>| axes.map(|axis| axis.dot(p));
    let base_at = |row: usize| base(model).map(|b| world_transforms(model, &run.configurations[row])[b].translation);
    let first = base_at(rows[0]);
    let mut lowest = f64::INFINITY;
    let mut seen: Vec<[f64; 3]> = Vec::new();
    for row in rows {
        let points = extent(model, limbs, &run.configurations[*row]);
        // the picture follows what floats
        let moved = base_at(*row).zip(first).map_or([0.0; 3], |(now, first)| along(now - first));
        for point in points.into_iter().map(along) {
            lowest = lowest.min(point[2]);
            seen.push([0, 1, 2].map(|k| point[k] - moved[k]));
        }
    }
    let thick = limbs.iter().map(|limb| limb.radius).fold(0.0, f64::max);
    let ends = |k: usize, start: f64, f: fn(f64, f64) -> f64| seen.iter().map(|point| point[k]).fold(start, f);
    let middle = [0, 1, 2].map(|k| (ends(k, f64::INFINITY, f64::min) + ends(k, f64::NEG_INFINITY, f64::max)) / 2.0);
    let squares = seen.iter().map(|point| (0..3).map(|k| (point[k] - middle[k]) * (point[k] - middle[k])).sum::<f64>());
    let radius = squares.fold(0.0, f64::max).sqrt() + 3.0 * thick;
    let target = axes.iter().zip(middle).fold(Vec3::zero(), |sum, (axis, x)| sum + axis.scale(x));
    // a fixed base stands on the ground, unless the robot hangs below it
    let thinnest = limbs.iter().map(|limb| limb.radius).fold(thick, f64::min);
    let ground = match model.floats() {
        false if lowest > -2.0 * thick => 0.0,
        false => lowest - thick,
        true => lowest - thinnest,
    };
    let camera = Camera {
        axes: axes.map(|axis| single(axis.to_array())),
        target: single(target.to_array()),
        distance: (radius / (FIELD_OF_VIEW / 2.0).sin()) as f32,
        azimuth: azimuth(model, run, axes) as f32,
        elevation: 0.3,
        field_of_view: FIELD_OF_VIEW as f32,
    };
    (camera, ground)
}

/// From the first to the second horizontal direction \[rad\]: in front of what moves in a plane, else from the side.
fn azimuth(model: &Model<f64>, run: &ViewedRun, axes: [Vec3<f64>; 3]) -> f64 {
    let poses = world_transforms(model, &run.configurations[0]);
    let turning = model.bodies.iter().zip(&poses).filter(|(body, _)| body.joint.kind.turns());
    let mut turning = turning.map(|(_, pose)| Mat3::column(&pose.rotation, 2));
    let aside = 0.35;
    match turning.next() {
        Some(axis) if turning.all(|other| axis.dot(other).abs() > 0.999) && axis.dot(axes[2]).abs() < 0.1 => {
            // from the side where azimuth is near its usual value
            let angle = axis.dot(axes[1]).atan2(axis.dot(axes[0]));
            let angle = if angle > 0.0 { angle - std::f64::consts::PI } else { angle };
            angle + aside
        }
        _ => -0.95,
    }
}
