/// The plan of people's bodies: SMPL's joints (body/skeleton.hpp), which limbs they make, how they bend, and the
/// proportions of characters.
/// Deviations of proportions are those among people beyond what a body's own shapes tell; the factors drawn for
/// training reach far beyond people (big heads, short legs).
#pragma once

#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>

#include <string_view>

namespace npt::inline NPT_ABI {

/// Hips, shoulders, elbows and knees move most; the trunk and the ends of the limbs little.
inline constexpr std::string_view people_plan_text = R"(plan person people
#     NAME       PARENT     MIRRORED   LIMB      KIND   TOWARD     STIFFNESS DENSITY HINGE
joint pelvis     -          pelvis     trunk     root   spine1     10 1
joint l_hip      pelvis     r_hip      left_leg  bone   l_knee     1 1
joint r_hip      pelvis     l_hip      right_leg bone   r_knee     1 1
joint spine1     pelvis     spine1     trunk     spine  spine2     10 1
joint l_knee     l_hip      r_knee     left_leg  bone   l_ankle    10 1  -1 0 0
joint r_knee     r_hip      l_knee     right_leg bone   r_ankle    10 1  -1 0 0
joint spine2     spine1     spine2     trunk     spine  spine3     10 1
joint l_ankle    l_knee     r_ankle    left_leg  end    l_foot     10 2
joint r_ankle    r_knee     l_ankle    right_leg end    r_foot     10 2
joint spine3     spine2     spine3     trunk     spine  neck       10 1
joint l_foot     l_ankle    r_foot     left_leg  tip    l_foot     10 2
joint r_foot     r_ankle    l_foot     right_leg tip    r_foot     10 2
joint neck       spine3     neck       skull     neck   head       10 1
joint l_collar   spine3     r_collar   trunk     girdle l_shoulder 1 1
joint r_collar   spine3     l_collar   trunk     girdle r_shoulder 1 1
joint head       neck       head       skull     head   head       10 4
joint l_shoulder l_collar   r_shoulder left_arm  bone   l_elbow    1 1
joint r_shoulder r_collar   l_shoulder right_arm bone   r_elbow    1 1
joint l_elbow    l_shoulder r_elbow    left_arm  bone   l_wrist    10 1  0 1 0
joint r_elbow    r_shoulder l_elbow    right_arm bone   r_wrist    10 1  0 -1 0
joint l_wrist    l_elbow    r_wrist    left_arm  end    l_hand     10 2
joint r_wrist    r_elbow    l_wrist    right_arm end    r_hand     10 2
joint l_hand     l_wrist    r_hand     left_arm  tip    l_hand     10 2
joint r_hand     r_wrist    l_hand     right_arm tip    r_hand     10 2
#          NAME             DEVIATION LOW  HIGH
proportion size             0.10      0.85 1.15
proportion trunk_length     0.06      0.75 1.25
proportion trunk_width      0.08      0.80 1.60
proportion trunk_depth      0.08      0.80 1.70
proportion shoulder_width   0.08      0.75 1.35
proportion hip_girth        0.08      0.80 1.40
proportion neck_length      0.10      0.50 1.20
proportion head_size        0.08      0.85 2.30
proportion upper_arm_length 0.06      0.60 1.20
proportion forearm_length   0.06      0.60 1.20
proportion arm_girth        0.12      0.75 1.80
proportion hand_size        0.10      0.80 1.80
proportion thigh_length     0.06      0.50 1.20
proportion shin_length      0.06      0.50 1.20
proportion leg_girth        0.12      0.75 1.80
proportion foot_size        0.12      0.80 1.80
grows size all pelvis l_hip r_hip spine1 l_knee r_knee spine2 l_ankle r_ankle spine3 l_foot r_foot
grows size all neck l_collar r_collar head l_shoulder r_shoulder l_elbow r_elbow l_wrist r_wrist l_hand r_hand
grows trunk_length     y        pelvis spine1 spine2 spine3
grows trunk_width      x        pelvis spine1 spine2 spine3
grows trunk_depth      z        pelvis spine1 spine2 spine3
grows shoulder_width   x        l_collar r_collar
grows hip_girth        across_y pelvis
grows neck_length      y        neck
grows head_size        all      head
grows upper_arm_length length   l_shoulder r_shoulder
grows forearm_length   length   l_elbow r_elbow
grows arm_girth        girth    l_shoulder r_shoulder l_elbow r_elbow
grows hand_size        all      l_wrist r_wrist l_hand r_hand
grows thigh_length     length   l_hip r_hip
grows shin_length      length   l_knee r_knee
grows leg_girth        girth    l_hip r_hip l_knee r_knee
grows foot_size        all      l_ankle r_ankle l_foot r_foot
)";

inline const BodyPlan& people_plan() {
  static const BodyPlan plan = read_body_plan(people_plan_text, "people_plan.hpp");
  return plan;
}

}  // namespace npt::inline NPT_ABI
