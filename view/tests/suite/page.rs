//! The text of a page, read without a browser.

use super::robots::{arm, hostile};
use base64::{engine::general_purpose::STANDARD, Engine};
use serde_json::Value;
use straightline_core::algorithms::forward_kinematics;
use straightline_core::model::{Frame, Model};
use straightline_core::spatial::Transform;
use straightline_view::{page, ViewedLook, ViewedRun};

pub fn written(model: &Model<f64>, run: &ViewedRun) -> String {
    page(model, &ViewedLook::default(), run, &[("Robot file", "a.toml".to_string())]).unwrap()
}

/// What a browser takes for the text of the first element that begins so.
fn inside<'a>(page: &'a str, head: &str, end: &str) -> &'a str {
    let from = page.find(head).unwrap_or_else(|| panic!("there is no {head}")) + head.len();
    &page[from..from + page[from..].find(end).expect("it ends")]
}

pub fn data(page: &str) -> Value {
    serde_json::from_str(inside(page, "<script type=\"application/json\" id=\"data\">", "</script>")).expect("JSON")
}

fn singles(text: &Value) -> Vec<f32> {
    let bytes = STANDARD.decode(text.as_str().unwrap()).unwrap();
    bytes.chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
}

#[test]
fn poses_are_those_of_forward_kinematics_in_single_precision() {
    for model in [arm(), hostile()] {
        let run = ViewedRun::tour(&model);
        let data = data(&written(&model, &run));
        let poses = singles(&data["poses"]);
        assert_eq!(poses.len(), 7 * model.bodies.len() * run.times.len());
        for (row, q) in run.configurations.iter().enumerate() {
            for b in 0..model.bodies.len() {
                let frame = Frame { name: String::new(), body: Some(b), placement: Transform::identity() };
                let expected = forward_kinematics(&model, q, &[&frame])[0];
                let [x, y, z, i, j, k, w] = poses[7 * (row * model.bodies.len() + b)..][..7] else { panic!("seven") };
                let position = expected.translation.to_array().map(|x| x as f32);
                assert_eq!([x, y, z], position, "row {row}, body {b}");
                // the rotation that the quaternion stands for
                let [i, j, k, w] = [i, j, k, w].map(f64::from);
                let rows = [
                    [1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - k * w), 2.0 * (i * k + j * w)],
                    [2.0 * (i * j + k * w), 1.0 - 2.0 * (i * i + k * k), 2.0 * (j * k - i * w)],
                    [2.0 * (i * k - j * w), 2.0 * (j * k + i * w), 1.0 - 2.0 * (i * i + j * j)],
                ];
                let pairs = rows.iter().flatten().zip(expected.rotation.rows.iter().flatten());
                pairs.for_each(|(a, b)| assert!((a - b).abs() < 4e-7, "row {row}, body {b}: {a} {b}"));
            }
        }
    }
}

#[test]
fn names_cannot_leave_the_element_of_the_data() {
    let model = hostile();
    let page = written(&model, &ViewedRun::tour(&model));
    assert_eq!(page.matches("<script").count(), 2, "the data and the script");
    assert_eq!(page.matches("</script").count(), 2);
    assert!(!page.contains("<!--") && !page.contains("<img") && !page.contains("</title><") && !page.contains("<b>"));
    let data = data(&page);
    assert_eq!(data["title"], model.name.as_str());
    data["bodies"]
        .as_array()
        .unwrap()
        .iter()
        .zip(&model.bodies)
        .for_each(|(a, b)| assert_eq!(a["name"], b.name.as_str()));
    assert_eq!(data["frames"][0]["name"], model.frames[0].name.as_str());
}

#[test]
fn a_page_is_small_asks_for_nothing_and_is_the_same_each_time() {
    let model = arm();
    let run = ViewedRun::tour(&model);
    let page = written(&model, &run);
    assert!(page.len() < 400_000, "{} bytes", page.len());
    assert_eq!(page, written(&model, &run));
    let namespace = "\"http://www.w3.org/2000/svg\"";
    assert_eq!(page.matches("http").count(), 2, "a namespace, and http-equiv");
    assert_eq!(page.matches(namespace).count(), 1);
    for word in [
        "src=",
        "href=",
        "url(",
        "@import",
        "fetch(",
        "XMLHttpRequest",
        "WebSocket",
        "import(",
        "innerHTML",
        "eval(",
        "document.write",
    ] {
        assert!(!page.contains(word), "{word}");
    }
    let policy = inside(&page, "Content-Security-Policy\" content=\"", "\">");
    assert!(policy.starts_with("default-src 'none'; script-src 'sha256-"), "{policy}");
    assert!(!policy.contains("unsafe") && !policy.contains('*'), "{policy}");
}

#[test]
fn a_long_run_is_thinned_and_the_page_says_so() {
    let model = arm();
    let rows = 20_000;
    let times: Vec<f64> = (0..rows).map(|k| 1e-3 * k as f64).collect();
    let configurations: Vec<Vec<f64>> =
        times.iter().map(|t| vec![0.1 * t.sin(), 0.2 * t, 0.01, 0.0, 0.0, 0.0, 1.0]).collect();
    let column = ("tau.to_upper".to_string(), times.iter().map(|t| t * t).collect());
    let run = ViewedRun { times, configurations, columns: vec![column], notes: vec![] };
    let page = written(&model, &run);
    assert!(page.len() < 400_000, "{} bytes", page.len());
    let data = data(&page);
    let shown = data["rows"].as_u64().unwrap() as usize;
    assert!((500..=1500).contains(&shown), "{shown}");
    assert_eq!(
        data["notes"][0],
        format!("{shown} of {rows} rows of the run are shown; peaks between them are not seen.")
    );
    let torque = singles(&data["columns"][0]);
    assert_eq!((torque.len(), torque[0], *torque.last().unwrap()), (shown, 0.0, (19.999f64 * 19.999) as f32));
}

#[test]
fn columns_are_plotted_by_what_they_are_and_measured_in() {
    let model = arm();
    let mut run = ViewedRun::tour(&model);
    let zeros = vec![0.0; run.times.len()];
    let names = [
        "tau.to_upper",
        "tau.to_slide",
        "qd.to_hand.wx",
        "force.to_column.x",
        "force.to_column.y",
        "force.to_column.z",
        "residual.to_upper",
        "effort.to_column",
        "energy",
        "weather",
        "moment.to_column.x",
    ];
    run.columns.extend(names.map(|name| (name.to_string(), zeros.clone())));
    let data = data(&written(&model, &run));
    let charts: Vec<String> = data["charts"]
        .as_array()
        .unwrap()
        .iter()
        .map(|chart| {
            let lines: Vec<&str> =
                chart["lines"].as_array().unwrap().iter().map(|line| line["name"].as_str().unwrap()).collect();
            format!("{} [{}]: {}", chart["title"].as_str().unwrap(), chart["unit"].as_str().unwrap(), lines.join(" "))
        })
        .collect();
    assert_eq!(
        charts,
        [
            "Coordinates [rad]: to_column to_upper",
            "Coordinates [m]: to_slide",
            "Orientations, as quaternions []: to_hand.qx to_hand.qy to_hand.qz to_hand.qw",
            "Joint torques [N·m]: to_upper to_column",
            "Joint forces [N]: to_slide",
            "Residual torques [N·m]: to_upper",
            "Velocities [rad/s]: to_hand.wx",
            "Forces that joints carry [N]: to_column.x to_column.y to_column.z",
            "Moments that joints carry [N·m]: to_column.x",
            "Energies [J]: energy",
            "Other columns []: weather",
        ]
    );
    let arrows: Vec<&str> =
        data["arrows"].as_array().unwrap().iter().map(|arrow| arrow["group"].as_str().unwrap()).collect();
    // a moment with one component is no arrow
    assert_eq!(arrows, ["forces carried", "joint torques", "joint torques", "residual torques", "joint forces"]);
}

#[test]
fn a_run_of_another_robot_is_refused() {
    let failures = page(&arm(), &ViewedLook::default(), &ViewedRun::tour(&hostile()), &[]).unwrap_err();
    assert!(failures.iter().any(|failure| failure.what.contains("7 coordinates")), "{failures:?}");
    let failures = page(&arm(), &ViewedLook::default(), &ViewedRun::default(), &[]).unwrap_err();
    assert!(failures[0].what.contains("no row"), "{failures:?}");
}

#[test]
fn up_is_against_gravity() {
    let mut model = arm();
    model.gravity = straightline_core::spatial::Vec3::new(0.0, -9.81, 0.0);
    let camera = data(&written(&model, &ViewedRun::tour(&model)))["camera"].clone();
    assert_eq!(camera["axes"], serde_json::json!([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
}

#[test]
fn what_single_precision_does_not_hold_is_refused() {
    let model = arm();
    let mut run = ViewedRun::tour(&model);
    run.configurations[3][1] = 1e9;
    run.columns[0].1[2] = 1e39;
    let failures = page(&model, &ViewedLook::default(), &run, &[]).unwrap_err();
    let said: Vec<String> = failures.iter().map(ToString::to_string).collect();
    assert!(said.len() == 2 && said[0].contains("the pose of upper") && said[0].contains("to_upper"), "{said:?}");
    assert!(said[1].contains("`q.to_column` is 1e39"), "{said:?}");
}
