#include "llmt/robotics/robot_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

const std::string good = R"(name: two
convention: dh
gravity_m_s2: [0, 0, -9.81]
tool: {xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 0]}
joints:
  - {name: joint1, type: revolute, alpha_deg: 90, a_mm: 0, d_mm: 100, theta_deg: 0, limits_deg: [-180, 180]}
  - {name: joint2, type: prismatic, alpha_deg: 0, a_mm: 0, d_mm: 0, theta_deg: 0, limits_mm: [0, 300], mass_kg: 4}
effects:
  - {type: joint_compliance, at: joint1, compliance_rad_per_Nm: 1e-7}
)";

std::string with(const std::string& from, const std::string& to) {
  std::string text = good;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string message_of(const std::string& text) {
  try {
    parse_robot(text, "arm.yaml");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

void expect_message(const std::string& text, const std::string& place, const std::string& part) {
  const std::string message = message_of(text);
  EXPECT_TRUE(message.starts_with(place)) << message;
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

void expect_same(const Robot& a, const Robot& b) {
  EXPECT_EQ(geometric_values(a.chain), geometric_values(b.chain));
  EXPECT_EQ(a.chain.gravity_m_s2, b.chain.gravity_m_s2);
  EXPECT_EQ(a.chain.payload.mass_kg, b.chain.payload.mass_kg);
  EXPECT_EQ(a.chain.payload.com_mm, b.chain.payload.com_mm);
  EXPECT_EQ(a.chain.name, b.chain.name);
  EXPECT_EQ(a.chain.orientation, b.chain.orientation);
  ASSERT_EQ(a.chain.joints.size(), b.chain.joints.size());
  for (std::size_t j = 0; j < a.chain.joints.size(); ++j) {
    const Joint& p = a.chain.joints[j];
    const Joint& q = b.chain.joints[j];
    EXPECT_EQ(p.name, q.name);
    EXPECT_EQ(p.type, q.type);
    EXPECT_EQ(p.sign, q.sign);
    EXPECT_EQ(p.limits, q.limits);
    EXPECT_EQ(p.gear_ratio, q.gear_ratio);
    EXPECT_EQ(p.mass_kg, q.mass_kg);
    EXPECT_EQ(p.com_mm, q.com_mm);
  }
  ASSERT_EQ(a.effects.size(), b.effects.size());
  for (std::size_t e = 0; e < a.effects.size(); ++e) {
    EXPECT_EQ(a.effects[e].type, b.effects[e].type);
    EXPECT_EQ(a.effects[e].at, b.effects[e].at);
    EXPECT_EQ(a.effects[e].values, b.effects[e].values);
  }
  ASSERT_EQ(a.identified.size(), b.identified.size());
  for (std::size_t k = 0; k < a.identified.size(); ++k) {
    EXPECT_EQ(a.identified[k].name, b.identified[k].name);
    EXPECT_EQ(a.identified[k].state, b.identified[k].state);
    EXPECT_EQ(a.identified[k].standard_error, b.identified[k].standard_error);
  }
  EXPECT_EQ(a.correction_file, b.correction_file);
}

TEST(RobotFile, WritingAndReadingKeepsEveryBit) {
  Robot robot = perturbed(scara(), 1.0, 1.0, 1);
  robot.chain.name = "true: a #strange name";
  robot.chain.orientation = "intrinsic_xyz";
  robot.chain.gravity_m_s2 = {0.1, 1.0 / 3.0, -9.81};
  robot.chain.payload = {.mass_kg = 3.3, .com_mm = {0.1, 0.2, 0.3}};
  robot.chain.joints[0].limits = {-170.1, 1.0 / 7.0};
  robot.chain.joints[0].gear_ratio = -100.5;
  robot.chain.joints[1].b_mm = 1e-300;
  robot.chain.joints[1].mass_kg = 12.0;
  robot.chain.joints[1].com_mm = {1.0 / 3.0, 2e10, -0.1};
  robot.effects = {{"joint_compliance", "joint2", {1.0 / 3e7}}, {"link_bending", "joint1", {7.4852412976787945e-06}}};
  robot.identified = {{"joint1.a", 0.1 + 0.2, "free"},
                      {"joint1.d", {}, "not distinguishable from parameters before it"}};
  robot.correction_file = "arm correction.json";
  expect_same(parse_robot(to_yaml(robot), "again"), robot);
  EXPECT_EQ(to_yaml(parse_robot(to_yaml(robot), "again")), to_yaml(robot));
}

TEST(RobotFile, DescriptionsThatShipAreReadAndSurviveWriting) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LLMT_ROBOTS_DIR)) {
    const Robot robot = read_robot(entry.path().string());
    expect_same(parse_robot(to_yaml(robot), "again"), robot);
    ++count;
  }
  EXPECT_EQ(count, 10);
}

TEST(RobotFile, OptionalPartsMayBeAbsent) {
  const Robot robot = parse_robot(good, "arm.yaml");
  EXPECT_EQ(robot.chain.base.xyz_mm, Eigen::Vector3d::Zero());
  EXPECT_EQ(robot.chain.joints[1].type, JointType::prismatic);
  EXPECT_EQ(robot.effects[0].values[0], 1e-7);
  EXPECT_FALSE(robot.chain.joints[0].gear_ratio);
}

TEST(RobotFile, MistakesNameLineKeyAndWhatWouldBeRight) {
  expect_message(with("a_mm: 0, d_mm: 100", "a_m: 0, d_mm: 100"), "arm.yaml:6: joints[0]", "\"a_mm\" is missing");
  expect_message(with("limits_deg", "limit_deg"), "arm.yaml:6: joints[0]",
                 "unknown key \"limit_deg\"; known: name, type");
  expect_message(with("limits_mm: [0, 300]", "limits_deg: [0, 300]"), "arm.yaml:7",
                 "\"limits_deg\" does not belong here");
  expect_message(with("d_mm: 100", "d_mm: 100mm"), "arm.yaml:6", "\"d_mm\" must be a number, is \"100mm\"");
  expect_message(with("d_mm: 100", "d_mm: .nan"), "arm.yaml:6", "\"d_mm\" must be a number");
  expect_message(with("[1, 2, 3]", "[1, 2]"), "arm.yaml:4: tool", "list of 3 numbers");
  expect_message(with("prismatic", "linear"), "arm.yaml:7", "must be revolute or prismatic");
  expect_message(with("convention: dh", "convention: DH"), "arm.yaml:2: ", "must be dh or mdh");
  expect_message(with("joint_compliance", "joint_complience"), "arm.yaml:9: effects[0]",
                 "known: joint_compliance, joint_compliance_stiffening, joint_compliance_measured");
  expect_message(with("at: joint1", "at: joint7"), "arm.yaml:9: effects[0]", "no joint \"joint7\"");
  expect_message(with("name: joint2", "name: joint1"), "arm.yaml:7: joints[1]", "\"joint1\" is taken");
  expect_message(with("[-180, 180]", "[180, -180]"), "arm.yaml:6: joints[0]", "joint1: limits are [180, -180]");
  expect_message(good + "name: again\n", "arm.yaml:10", "\"name\" is there twice");
  expect_message(good + "jonts: []\n", "arm.yaml:10", "unknown key \"jonts\"");
  expect_message(with("joints:", "joints: ["), "arm.yaml:", "");
  expect_message("[1, 2]", "arm.yaml:1", "must be a map");
  expect_message("", "arm.yaml", "must be a map");
  EXPECT_THROW(read_robot("/does/not/exist.yaml"), std::runtime_error);
}

TEST(RobotFile, ValuesThatMakeNoSenseAreFoundAtTheirLine) {
  std::string joint =
      "  - name: joint3\n    type: revolute\n    alpha_deg: 0\n    a_mm: 0\n    d_mm: 0\n    theta_deg: 0\n";
  const auto with_joint = [&](const std::string& field) { return with("effects:\n", joint + field + "effects:\n"); };
  EXPECT_EQ(message_of(with_joint("    sign: 1\n")), "no error");
  expect_message(with_joint("    sign: 3\n"), "arm.yaml:14: joints[2]", "sign is 3, must be 1 or -1");
  expect_message(with_joint("    mass_kg: -1\n"), "arm.yaml:14: joints[2]", "mass_kg is -1");
  expect_message(with_joint("    gear_ratio: 0\n"), "arm.yaml:14: joints[2]", "gear_ratio is 0");
  expect_message(with_joint("    sign: -1\n    limits_deg: [1, 0]\n"), "arm.yaml:15: joints[2]", "limits are [1, 0]");
  joint.replace(joint.find("joint3"), 6, "joint2");
  expect_message(with_joint(""), "arm.yaml:8: joints[2]", "\"joint2\" is taken");
  expect_message(with("joints:", "payload: {mass_kg: -2}\njoints:"), "arm.yaml:5: ", "payload mass_kg is -2");
  expect_message("name: a\nconvention: dh\njoints: []\n", "arm.yaml:3: ", "there are no joints");
  expect_message(good + "  - {type: joint_compliance, at: joint1, compliance_rad_per_Nm: 2e-7}\n",
                 "arm.yaml:10: effects[1]", "effect joint_compliance@joint1 is there twice");
  expect_message(good +
                     "identified:\n  - {parameter: joint1.a, state: free}\n  - parameter: joint1.d\n    state: free\n"
                     "    unit: m\n",
                 "arm.yaml:14: identified[1]", "must be mm");
  expect_message(good + "identified:\n  - {parameter: joint1.a, state: free}\n  - {parameter: joint1.a, state: free}\n",
                 "arm.yaml:12: identified[1]", "\"joint1.a\" is there twice");
}

TEST(RobotFile, HoldsOneDocument) {
  expect_message(good + "---\nname: other\n", "arm.yaml:1", "a second document begins, a file holds one");
  EXPECT_EQ(message_of("---\n" + good + "...\n"), "no error");
  EXPECT_EQ(message_of("# nothing\n---\n" + good), "no error");
}

TEST(RobotFile, SizesAreBounded) {
  std::string joints;
  for (int j = 3; j <= 101; ++j) {
    joints +=
        "  - {name: joint" + std::to_string(j) + ", type: revolute, alpha_deg: 0, a_mm: 0, d_mm: 0, theta_deg: 0}\n";
  }
  expect_message(with("effects:\n", joints + "effects:\n"), "arm.yaml:6", "\"joints\" has 101 entries, at most 100");
  expect_message(with("name: two", "name: " + std::string(20000, 'x')), "arm.yaml:1",
                 "\"name\" has 20000 characters, at most 10000 are read");
  expect_message(good + std::string(17 << 20, '#'), "arm.yaml: ", "bytes, at most 16777216 are read");
  const std::string message = message_of(with("d_mm: 100", "d_mm: " + std::string(100000, 'x')));
  EXPECT_LT(message.size(), 200U) << message;
}

TEST(RobotFile, RemembersTheLinksOfTheUrdfThatItCameFrom) {
  Robot robot = ur_like();
  EXPECT_EQ(to_yaml(robot).find("urdf"), std::string::npos);
  robot.urdf_links = {.base = "base_link", .tip = "tool0"};
  const Robot read = parse_robot(to_yaml(robot), "arm.yaml");
  EXPECT_EQ(read.urdf_links.base, "base_link");
  EXPECT_EQ(read.urdf_links.tip, "tool0");
}

}  // namespace
}  // namespace llmt::robotics
