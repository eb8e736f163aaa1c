//! The attributes of elements whose numbers matter; another one there is complained of.

/// Of a body.
pub(super) const BODY: &str =
    "axisangle childclass euler fuse gravcomp mocap name pos quat simple sleep user xyaxes zaxis";
/// Of a frame.
pub(super) const FRAME: &str = "axisangle childclass euler name pos quat xyaxes zaxis";
/// Of a joint.
pub(super) const JOINT: &str =
    "actuatorfrclimited actuatorfrcrange actuatorgravcomp armature axis class damping frictionloss group limited \
    margin name pos range ref solimpfriction solimplimit solreffriction solreflimit springdamper springref \
    springyield stiffness type user";
/// Of the inertial of a body.
pub(super) const INERTIAL: &str = "axisangle diaginertia euler fullinertia mass pos quat xyaxes zaxis";
/// Of a geom.
pub(super) const GEOM: &str =
    "adhesion axisangle castshadow class conaffinity condim contype density euler fitscale fluidcoef fluidshape \
    friction fromto gap group hfield margin mass material mesh name pos priority quat rgba shellinertia size \
    solimp solmix solref surfacevel type user xyaxes zaxis";
/// Of the compiler.
pub(super) const COMPILER: &str =
    "alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict convexhull coordinate \
    discardvisual eulerseq exactmeshinertia fitaabb fusestatic inertiafromgeom inertiagrouprange meshdir \
    passthrough savecanonical savecompiled saveinertial settotalmass strippath texturedir usethread";
/// Of the option.
pub(super) const OPTION: &str =
    "actuatorgroupdisable apirate ccd_iterations ccd_tolerance collision cone density disableactuator gravity impratio \
    integrator iterations jacobian ls_iterations ls_tolerance magnetic mpr_iterations mpr_tolerance noslip_iterations \
    noslip_tolerance o_friction o_margin o_solimp o_solref sdf_initpoints sdf_iterations sleep_tolerance solver \
    timestep tolerance viscosity wind";
/// Of an equality of joints.
pub(super) const EQUALITY: &str = "active class joint1 joint2 name polycoef solimp solref";
/// Of a connection of two bodies.
pub(super) const CONNECT: &str = "active anchor body1 body2 class name site1 site2 solimp solref";
/// Of a weld of two bodies.
pub(super) const WELD: &str = "active anchor body1 body2 class name relpose site1 site2 solimp solref torquescale";
/// Of what attaches another model.
pub(super) const ATTACH: &str = "body model prefix";
