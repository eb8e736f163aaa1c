//! The page in Chromium, as people use it.

use super::support::{built, folder, natively, program, robot};
use serde_json::{json, Value};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Command, Stdio};

fn place(scenario: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("playground").join(scenario)
}

/// What a scenario of `tests/drive/browser.js` saw; `None`, and a word why, where something is missing.
fn seen(scenario: &str) -> Option<Value> {
    let browser = program(&["chromium", "chromium-browser", "google-chrome"]);
    let (Some(browser), Some(node), Some(page)) = (browser, program(&["node"]), built("playground.html")) else {
        eprintln!("skipped: Chromium, node, or target/playground.html, which `build` makes, is missing");
        return None;
    };
    let output = Command::new(node)
        .arg(folder().join("tests/drive/browser.js"))
        .args([&browser, &page])
        .arg(scenario)
        .arg(place(scenario))
        .stderr(Stdio::inherit())
        .output()
        .expect("node starts");
    let seen: Value = serde_json::from_slice(&output.stdout).expect("it says what it saw");
    assert!(seen["failed"].is_null(), "{}", seen["failed"].as_str().unwrap_or_default());
    // whatever is done, nothing is said on the console and nothing leaves the page
    assert_eq!(seen["said"], json!([]), "{scenario}");
    assert_eq!(seen["foreign"], json!([]), "{scenario}");
    Some(seen["result"].clone())
}

fn count(of: &Value) -> u64 {
    of.as_u64().unwrap_or_else(|| panic!("{of} is no count"))
}

#[test]
fn the_page_shows_code_counts_motion_limits_and_waterfall() {
    let Some(seen) = seen("first") else { return };
    println!("UR5 in Chromium: {} (milliseconds), {}", seen["done"], seen["about"]);
    assert!(count(&seen["code"]) > 10_000 && count(&seen["counts"]) > 5, "{seen}");
    assert!(count(&seen["sliders"]) > 15 && count(&seen["limits"]) > 18, "{seen}");
    assert!(count(&seen["vertices"]) > 3_000 && seen["problem"].is_null(), "{seen}");
    assert!(count(&seen["waterfall"]) > 3 && seen["waterfallAbout"].as_str().unwrap().contains("operations"), "{seen}");
    assert!(seen["about"].as_str().unwrap().contains("the same bits"), "{seen}");
    assert_eq!(seen["unnamed"], json!([]), "every control has a name");
    assert_eq!(seen["complaints"], complaints("ur5.urdf", &robot("ur5.urdf")));
    // nothing is wider than a narrow window
    assert!(count(&seen["narrow"]) <= 420, "{}", seen["narrow"]);
}

#[test]
fn everything_is_reached_by_keys() {
    let Some(seen) = seen("keyboard") else { return };
    let steps = &seen["steps"];
    assert!(steps["chosen"] != "planar_2r.toml", "{steps}");
    let complaint = steps["complaint"].as_str().unwrap();
    assert!(complaint.starts_with("error") && complaint.contains('^'), "{complaint}");
    assert_eq!(steps["selected"], json!([2, "robot", true]), "the complaint's button selects the place in the text");
    assert!(steps["payload"].as_str().unwrap().ends_with("kg") && steps["payload"] != "0 kg", "{steps}");
    assert_ne!(steps["outline"], "none", "the focus is seen");
}

/// What the native compiler says of a file.
fn complaints(name: &str, text: &str) -> Value {
    let said = natively("compile", &json!({ "name": name, "text": text, "quick": true }));
    said["complaints"].as_array().unwrap().iter().map(|complaint| complaint["text"].clone()).collect()
}

/// Of a limit's row its greatest value.
fn value(rows: &Value, what: &str) -> f64 {
    let row = rows.as_array().unwrap().iter().find(|row| row[0].as_str() == Some(what));
    let text = row.unwrap_or_else(|| panic!("no {what} in {rows}"))[1].as_str().unwrap();
    text.split('\u{a0}').next().unwrap().replace('\u{2212}', "-").parse().unwrap()
}

#[test]
fn sliders_change_torques_currents_and_heat_and_the_file_comes_back() {
    let Some(seen) = seen("sliders") else { return };
    println!(
        "sliders: mass {} ms, length {} ms, motor {} ms; {}",
        seen["massTime"], seen["lengthTime"], seen["motorTime"], seen["milliseconds"]
    );
    let torque = "shoulder_lift_joint: torque";
    assert!(value(&seen["heavier"], torque) > 1.05 * value(&seen["before"], torque));
    assert!(value(&seen["longer"], torque) > 1.02 * value(&seen["heavier"], torque));
    assert_eq!(value(&seen["hotter"], torque), value(&seen["longer"], torque));
    let heat = "shoulder_pan_joint: Joule heat, mean";
    assert!(value(&seen["hotter"], heat) > 1.5 * value(&seen["longer"], heat));
    assert_eq!(seen["milliseconds"]["compiled"], 0, "other motors are no other functions");
    assert_eq!(seen["after"], seen["before"]);
    assert_eq!(seen["taken"], json!([true, 6]), "the file has the mass, the scene the motors");
    assert!((value(&seen["takenLimits"], torque) - value(&seen["heavier"], torque)).abs() < 1e-9);
}

#[test]
fn broken_and_hostile_files_stay_text_and_nothing_leaves() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let address = listener.local_addr().unwrap();
    let name = format!("</script><img src=//{address}/a onerror=alert(1)><b>x</b>");
    let escaped = name.replace('<', "&lt;").replace('>', "&gt;");
    let hostile = robot("planar2r.urdf").replace("link1", &escaped);
    let texts = [
        (format!("{name}.urdf"), hostile),
        (
            "picture-broken.toml".to_string(),
            robot("planar_2r.toml").replacen("mass = 1.5", "mass = -1.5", 1).replacen(
                "axis = \"z\"",
                "axis = \"w\"",
                1,
            ),
        ),
        ("empty.urdf".to_string(), String::new()),
        ("planar_2r.toml".to_string(), robot("planar_2r.toml")),
    ];
    let files: Vec<Value> = texts.iter().map(|(name, text)| json!({ "name": name, "text": text })).collect();
    std::fs::create_dir_all(place("files")).unwrap();
    std::fs::write(place("files").join("files.json"), json!(files).to_string()).unwrap();
    let Some(seen) = seen("files") else { return };
    assert!(listener.accept().is_err(), "the page has asked for something");
    for ((file, text), seen) in texts.iter().zip(seen.as_array().unwrap()) {
        assert_eq!(seen["complaints"], complaints(file, text), "{file}");
        assert_eq!(seen["markup"], 0, "{file}: names are text");
    }
    let (broken, last) = (&seen[1], &seen[3]);
    assert!(
        broken["complaints"].as_array().unwrap().len() >= 2 && broken["status"].as_str().unwrap().contains("no code"),
        "{broken}"
    );
    assert!(last["complaints"] == json!([]) && count(&last["code"]) > 1_000, "{last}");
}
