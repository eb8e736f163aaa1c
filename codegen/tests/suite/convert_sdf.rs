//! What is written as SDF is what the format is made for: one joint where it has one, frames where nothing has mass, unit quaternions, names that it can
//! have.

use straightline_codegen::convert::{convert, format_of_word, ConvertOptions};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};

/// The SDF of a robot, and what is said.
fn sdf(name: &str, text: &str) -> (String, Diagnostics) {
    let mut said = Diagnostics::new();
    let format = format_of_word("sdf").expect("SDF is written");
    let written = convert(&Source::new(name, text), format, ConvertOptions::default(), &mut said);
    (written.unwrap_or_else(|| panic!("{said}\n{text}")), said)
}

/// What an element of a name holds, on one line.
fn element(text: &str, start: &str) -> String {
    let from = text.find(start).unwrap_or_else(|| panic!("no {start} in\n{text}"));
    let name = start[1..].split([' ', '>']).next().expect("a name");
    let end = text[from..].find(&format!("</{name}>")).unwrap_or_else(|| panic!("{start} does not end in\n{text}"));
    text[from..from + end].lines().map(str::trim).collect()
}

const INERTIAL: &str = "<inertial pos=\"0.1 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
const OF_LINK: &str = "<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>";

#[test]
fn a_joint_beside_the_frame_of_its_link_is_one_joint() {
    let text = format!(
        "<mujoco><worldbody><body name=\"a\" pos=\"0 0 1\"><joint name=\"j\" pos=\"0.1 0 0.2\" axis=\"0 3 4\" ref=\"0\"/>{INERTIAL}\
         <body name=\"b\" quat=\"1 1 0 0\"><joint name=\"k\" type=\"ball\" pos=\"0 0.3 0\"/>{INERTIAL}</body></body></worldbody></mujoco>"
    );
    let (text, said) = sdf("a.xml", &text);
    assert!(said.is_empty(), "{said}");
    assert_eq!(text.matches("<link").count(), 2, "{text}");
    let j = element(&text, "<joint name=\"j\"");
    assert!(j.contains("<pose>0.1 0 0.2 0 0 0</pose><parent>world</parent><child>a</child>"), "{j}");
    assert!(j.contains("<axis><xyz>0 0.6 0.8</xyz></axis>"), "{j}");
    let k = element(&text, "<joint name=\"k\" type=\"ball\">");
    assert!(k.ends_with("<pose>0 0.3 0 0 0 0</pose><parent>a</parent><child>b</child>"), "{k}");
    // quaternions have length 1
    let half = 0.5f64.sqrt();
    let b = element(&text, "<link name=\"b\">");
    let pose = format!("<pose relative_to=\"a\" rotation_format=\"quat_xyzw\">0 0 0 {half:?} 0 0 {half:?}</pose>");
    assert!(b.contains(&pose), "{b}");
}

/// Joints with poses of their own, axes in other frames, and all words of the format.
#[test]
fn an_sdf_comes_back_with_its_links_joints_and_frames() {
    let link = |name: &str, pose: &str| format!("<link name=\"{name}\"><pose>{pose}</pose>{OF_LINK}</link>");
    let text = format!(
        "<sdf version=\"1.11\"><world name=\"w\"><gravity>0 0 -1.62</gravity><frame name=\"corner\"><pose>1 2 3 0 0 0.5</pose></frame><model name=\"m\">\
         {}{}{}{}{}<frame name=\"tip\" attached_to=\"d\"><pose>0 0 0.2 0.1 0 0</pose></frame>\
         <joint name=\"u\" type=\"universal\"><pose>0.1 0 0 0.3 0 0</pose><parent>world</parent><child>a</child><axis><xyz>1 0 0</xyz></axis>\
         <axis2><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis2></joint>\
         <joint name=\"s\" type=\"screw\"><parent>a</parent><child>b</child><screw_thread_pitch>0.005</screw_thread_pitch>\
         <axis><xyz>0 0 1</xyz><dynamics><damping>0.5</damping><spring_stiffness>3</spring_stiffness><spring_reference>0.1</spring_reference></dynamics></axis></joint>\
         <joint name=\"r\" type=\"revolute\"><pose>0 0 0.4 0 0.2 0</pose><parent>b</parent><child>c</child><axis><xyz expressed_in=\"__model__\">0 0 1</xyz>\
         <limit><lower>-1</lower><effort>7</effort><velocity>0</velocity></limit><mimic joint=\"u\" axis=\"axis2\"><multiplier>2</multiplier><offset>0.5</offset></mimic></axis></joint>\
         <joint name=\"f\" type=\"fixed\"><parent>c</parent><child>d</child></joint>\
         <joint name=\"l\" type=\"ball\"><pose>0 0 0.1 0.5 0 0</pose><parent>d</parent><child>e</child></joint></model></world></sdf>",
        link("a", "0 0 0.1 0 0 0"), link("b", "0 0.3 0 0 0 1.5707963267948966"), link("c", "1 0 0 0.1 0.2 0.3"), link("d", "2 0 0 0 0 0"), link("e", "2 1 0 0 0 0")
    );
    let (text, said) = sdf("m.sdf", &text);
    assert!(said.is_empty(), "{said}");
    let count = |what: &str| text.matches(what).count();
    assert_eq!([count("<link"), count("<joint"), count("<frame")], [5, 5, 2], "{text}");
    assert!(text.contains("<sdf version=\"1.11\">") && text.contains("<gravity>0 0 -1.62</gravity>"), "{text}");
    // the frame of the world stands beside the model
    assert!(text.find("<frame name=\"corner\">") < text.find("<model"), "{text}");
    for (start, parts) in [
        ("<frame name=\"tip\" attached_to=\"d\">", &["<pose>0 0 0.2 0.1 0 0</pose>"][..]),
        ("<joint name=\"u\" type=\"universal\">", &["<axis2><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis2>"]),
        ("<joint name=\"s\" type=\"screw\">", &["<screw_thread_pitch>0.005</screw_thread_pitch>", "<damping>0.5</damping><spring_reference>0.1</spring_reference><spring_stiffness>3</spring_stiffness>"]),
        ("<joint name=\"r\" type=\"revolute\">", &["<lower>-1</lower><effort>7</effort><velocity>0</velocity>", "<mimic joint=\"u\" axis=\"axis2\"><multiplier>2</multiplier><offset>0.5</offset><reference>0</reference></mimic>"]),
        ("<joint name=\"l\" type=\"ball\">", &["<pose rotation_format"]),
    ] {
        let found = element(&text, start);
        parts.iter().for_each(|part| assert!(found.contains(part), "{part} in {found}"));
    }
}

/// A pitch is P/2π with an f64 P, or the slide is a joint that follows.
#[test]
fn a_screw_is_written_where_its_pitch_is_one() {
    let mut counts = [0, 0];
    for k in 1..40 {
        let text = format!(
            "[robot]\nname = \"m\"\n[[link]]\nname = \"base\"\n[[link]]\nname = \"a\"\nmass = 1.0\ninertia = [1, 1, 1]\n[[joint]]\nname = \"s\"\nkind = \"helical\"\n\
             parent = \"base\"\nchild = \"a\"\naxis = \"z\"\npitch = {:?}\nlimits = {{ lower = -2, upper = 3 }}\n",
            0.0137 * f64::from(k)
        );
        // the comparison sees to it that the ratio is the same
        let (text, _) = sdf("m.toml", &text);
        let is_screw = text.contains("type=\"screw\"");
        assert!(is_screw || text.contains("<mimic joint=\"s\">"), "{text}");
        counts[usize::from(is_screw)] += 1;
    }
    assert!(counts[0] > 0 && counts[1] > 20, "{counts:?}");
}

fn toml(base: &str, more: &str) -> String {
    format!(
        "[robot]\nname = \"arm\"\n[[link]]\nname = \"{base}\"\n[[link]]\nname = \"upper\"\nmass = 2.0\ninertia = [0.1, 0.2, 0.15]\n[[joint]]\nname = \"shoulder\"\n\
         kind = \"continuous\"\nparent = \"{base}\"\nchild = \"upper\"\naxis = \"y\"\norigin = {{ xyz = [0.1, 0.2, 0.3] }}\n{more}"
    )
}

fn fixed(parent: &str, child: &str) -> String {
    format!("[[link]]\nname = \"{child}\"\n[[joint]]\nname = \"{child}_weld\"\nkind = \"fixed\"\nparent = \"{parent}\"\nchild = \"{child}\"\norigin.xyz = [0, 0, 0.5]\n")
}

#[test]
fn links_without_mass_on_fixed_joints_are_frames() {
    let elbow = "[[link]]\nname = \"fore\"\nmass = 1.0\ninertia = [1, 1, 1]\n[[joint]]\nname = \"elbow\"\nkind = \"prismatic\"\nparent = \"flange\"\nchild = \"fore\"\naxis = \"x\"\nlimits = { lower = 0, upper = 1 }\n";
    let more = fixed("upper", "flange") + &fixed("flange", "tool") + &fixed("base", "camera") + elbow;
    let (text, said) = sdf("arm.toml", &toml("base", &more));
    assert_eq!(said.iter().map(|d| d.code).collect::<Vec<_>>(), ["said-otherwise"], "{said}");
    assert!(
        said.to_string().contains("link `flange` (line 17), link `tool` (line 25), link `camera` (line 33)"),
        "{said}"
    );
    assert!(text.contains("<sdf version=\"1.9\">") && !text.contains("<world"), "{text}");
    for part in [
        "<frame name=\"flange\" attached_to=\"upper\">",
        "<frame name=\"tool\" attached_to=\"flange\">",
        "<frame name=\"camera\" attached_to=\"base\">",
    ] {
        assert!(element(&text, part).ends_with("<pose>0 0 0.5 0 0 0</pose>"), "{text}");
    }
    assert!(element(&text, "<link name=\"fore\">").contains("<pose relative_to=\"flange\"/>"), "{text}");
    assert!(element(&text, "<joint name=\"elbow\"").contains("<parent>flange</parent>"), "{text}");
    assert!(element(&text, "<joint name=\"base_fixed\" type=\"fixed\">").contains("<parent>world</parent>"), "{text}");
}

/// What stands on a root called `world` is in the world itself: links on fixed joints, as no frame of a model does, and frames beside the model.
#[test]
fn the_world_is_no_link() {
    let frame = "[[frame]]\nname = \"corner\"\nlink = \"world\"\nxyz = [1, 0, 0]\n[[frame]]\nname = \"arm\"\nlink = \"world\"\n";
    let (text, said) = sdf("arm.toml", &toml("world", &(fixed("world", "table") + frame)));
    assert!(!text.contains("<link name=\"world\"") && text.contains("<link name=\"table\">"), "{text}");
    assert!(text.contains("<gravity>0 0 -9.81</gravity>"), "{text}");
    assert!(element(&text, "<link name=\"upper\">").contains("<pose>0.1 0.2 0.3 0 0 0</pose>"), "{text}");
    // the model has the other one's name already
    assert!(text.contains("<frame name=\"corner\">") && text.contains("<frame name=\"arm_frame\">"), "{text}");
    assert!(said.to_string().contains("frame `arm` (line 29)"), "{said}");
}

#[test]
fn a_robot_that_floats_is_on_no_joint() {
    let text = toml("trunk", "").replace("[robot]", "[robot]\nbase = \"floating\"");
    let text = text.replace("name = \"trunk\"\n", "name = \"trunk\"\nmass = 3.0\ninertia = [1, 1, 1]\n");
    let (text, said) = sdf("arm.toml", &text);
    assert!(said.is_empty() && !text.contains(">world<"), "{said}{text}");
    assert_eq!(text.matches("<joint").count(), 1, "{text}");
}

#[test]
fn names_that_sdf_cannot_have_become_others() {
    let more = "[[frame]]\nname = \"__tip__\"\nlink = \"hand::palm\"\n[[link]]\nname = \" fore\"\nmass = 1.0\ninertia = [1, 1, 1]\n[[joint]]\nname = \"elbow_joint\"\n\
                kind = \"continuous\"\nparent = \"hand::palm\"\nchild = \" fore\"\naxis = \"x\"\n[[coupling]]\njoint = \"elbow_joint\"\nfollows = \"elbow\"\n";
    let text = toml("base", more)
        .replace("upper", "hand::palm")
        .replace("shoulder", "elbow")
        .replace("name = \"base\"", "name = \"elbow\"");
    let (text, said) = sdf("arm.toml", &text.replace("parent = \"base\"", "parent = \"elbow\""));
    let model = load(&Source::new("a.sdf", text.clone()), &ModelOptions::default()).0.expect("it is read");
    let joints: Vec<&str> = model.bodies.iter().map(|body| body.joint.name.as_str()).collect();
    let mut frames: Vec<&str> = model.frames.iter().map(|frame| frame.name.as_str()).collect();
    frames.sort_unstable();
    assert_eq!(joints, ["elbow_joint_2", "elbow_joint"], "{text}");
    assert_eq!(frames, ["__tip___frame", "elbow", "fore", "hand_palm", "world"], "{text}");
    let list = "link `hand::palm` (line 6), link ` fore` (line 20), frame `__tip__` (line 17), joint `elbow` (line 10)";
    assert!(said.to_string().contains(list), "{said}");
}

/// Couplings are those of the joints that follow, in whatever order the file has them.
#[test]
fn couplings_may_stand_in_any_order() {
    let joint = |name: &str, parent: &str| {
        format!("[[link]]\nname = \"{name}_link\"\nmass = 1.0\ninertia = [1, 1, 1]\n[[joint]]\nname = \"{name}\"\nkind = \"continuous\"\nparent = \"{parent}\"\nchild = \"{name}_link\"\naxis = \"x\"\n")
    };
    let couplings = "[[coupling]]\njoint = \"c\"\nfollows = \"b\"\nratio = 3.0\n[[coupling]]\njoint = \"b\"\nfollows = \"shoulder\"\noffset = 0.25\n";
    let text = toml("base", &(joint("b", "upper") + &joint("c", "b_link") + couplings));
    let (text, _) = sdf("arm.toml", &text);
    let b = element(&text, "<joint name=\"b\"");
    assert!(b.contains("<mimic joint=\"shoulder\"><multiplier>1</multiplier><offset>0.25</offset>"), "{b}");
    let mut said = Diagnostics::new();
    let urdf = format_of_word("urdf").expect("URDF is written");
    let back = convert(&Source::new("a.sdf", text), urdf, ConvertOptions::default(), &mut said);
    assert!(back.is_some(), "{said}");
}
