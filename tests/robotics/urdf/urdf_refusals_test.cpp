// What a URDF says of limits, masses and links beside the arm, and what is refused by name.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/urdf.hpp"

namespace llmt::robotics {
namespace {

std::string robot(const std::string& inside) { return "<robot name=\"r\">\n" + inside + "</robot>\n"; }

std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& more = "") {
  return fmt::format(
      "<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/><axis xyz=\"0 0 1\"/>"
      "<limit lower=\"-1\" upper=\"2\" effort=\"1\" velocity=\"1\"/>{}</joint>\n",
      name, type, parent, child, more);
}

std::string message(const std::string& text, const UrdfLinks& links = {}) {
  try {
    parse_urdf(text, "arm.urdf", links);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(UrdfText, WhatIsNoArmIsRefusedByName) {
  const std::string links = "<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\n";
  const std::string fork = robot(links + joint("j", "revolute", "a", "b") + joint("k", "revolute", "a", "c"));
  const auto says = [](const std::string& found, const std::string& expected) {
    EXPECT_NE(found.find(expected), std::string::npos) << found;
  };
  says(message("<robot name=\"r\">\n<link name=\"a\">\n</robot>\n"), "arm.urdf:");
  says(message("no XML"), "arm.urdf:");
  says(message("<sdf/>"), "no URDF");
  says(message(fork), "b (1 joints), c (1 joints)");
  EXPECT_EQ(message(fork, {.base = "", .tip = "c"}), "");
  says(message(fork, {.base = "", .tip = "x"}), "no link \"x\"; links: a, b, c");
  says(message(fork, {.base = "b", .tip = "c"}), "no joint between the links \"b\" and \"c\"");
  says(message(robot(links + joint("j", "floating", "a", "b") + joint("k", "revolute", "b", "c"))),
       "\"j\" is planar or");
  says(message(robot(links + joint("j", "revolute", "a", "b") +
                     joint("k", "revolute", "b", "c", "<mimic joint=\"finger\" multiplier=\"2\"/>"))),
       "\"k\" mimics \"finger\", which does not lie between base and tip");
  says(message(robot(links + joint("j", "fixed", "a", "b") + joint("k", "fixed", "b", "c"))), "no joint beyond");
  std::string deep;
  for (int k = 0; k < 200; ++k) deep += "<a>";
  says(message(deep), "nested deeper");
}

std::string joined(const std::string& more) {
  return robot("<link name=\"r\"/><link name=\"s\"/>\n" + joint("j", "revolute", "r", "s") + more);
}

TEST(UrdfText, LinksThatAreNoTreeAreRefused) {
  const std::string two = "<link name=\"a\"/><link name=\"b\"/>";
  const std::string loop = joint("k", "revolute", "a", "b") + joint("l", "revolute", "b", "a");
  EXPECT_EQ(message(joined(two + loop)), "arm.urdf: links \"a\", \"b\" form a loop");
  EXPECT_EQ(message(joined(two + loop), {.base = "", .tip = "a"}), "arm.urdf: links \"a\", \"b\" form a loop");
  EXPECT_EQ(message(joined(two + loop + "<link name=\"c\"/>" + joint("m", "fixed", "b", "c"))),
            "arm.urdf: links \"a\", \"b\" form a loop");
  EXPECT_EQ(message(joined("<link name=\"a\"/>" + joint("k", "fixed", "a", "a"))),
            "arm.urdf: joint \"k\" makes link \"a\" its own child");
  EXPECT_EQ(message(joined(two + joint("k", "fixed", "s", "a") + joint("l", "fixed", "s", "b") +
                           joint("m", "fixed", "a", "b"))),
            "arm.urdf: link \"b\" has two parents: joints \"l\" and \"m\"");
  // Ten links of a loop are shown, from the first name on up.
  const auto loop_of = [](int links) {
    std::string text;
    for (int k = 0; k < links; ++k) text += fmt::format("<link name=\"l{:02}\"/>", k);
    for (int k = 0; k < links; ++k)
      text += joint(fmt::format("k{}", k), "fixed", fmt::format("l{:02}", k), fmt::format("l{:02}", (k + 1) % links));
    return message(joined(text));
  };
  EXPECT_EQ(
      loop_of(10),
      "arm.urdf: links \"l00\", \"l09\", \"l08\", \"l07\", \"l06\", \"l05\", \"l04\", \"l03\", \"l02\", \"l01\" form a "
      "loop");
  EXPECT_EQ(loop_of(12),
            "arm.urdf: links \"l00\", \"l11\", \"l10\", \"l09\", \"l08\", \"l07\", \"l06\", \"l05\", \"l04\", \"l03\" "
            "and more "
            "form a loop");
}

// What hangs on a link beside the arm is carried as it stands at zero, whether it could move or not.
TEST(UrdfText, AJointCarriesWhatHangsBesideTheArm) {
  const auto link = [](const std::string& name, double mass, double height) {
    return fmt::format(
        "<link name=\"{}\"><inertial><origin xyz=\"0 0 {}\"/><mass value=\"{}\"/><inertia ixx=\"1\" ixy=\"0\" "
        "ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>",
        name, height, mass);
  };
  const auto at = [](const std::string& xyz) { return "<origin xyz=\"" + xyz + "\"/>"; };
  const Chain chain = parse_urdf(
      robot("<link name=\"a\"/>" + link("b", 1.0, 0.1) + link("c", 5.0, 0.0) + link("finger", 2.0, 0.0) +
            link("nail", 3.0, 0.5) + link("box", 4.0, 0.0) + joint("j", "revolute", "a", "b") +
            joint("f", "revolute", "b", "finger", at("1 0 0")) + joint("n", "fixed", "finger", "nail", at("0 1 0")) +
            joint("k", "revolute", "b", "c", at("0 0 2")) + joint("x", "fixed", "b", "box", at("0 0 -1"))),
      "arm.urdf", {.base = "a", .tip = "c"});
  const Skeleton skeleton = Kinematics(chain).skeleton(Eigen::VectorXd::Zero(2));
  EXPECT_NEAR(chain.joints[0].mass_kg, 1.0 + 2.0 + 3.0 + 4.0, 1e-12);
  // (1 (0, 0, 0.1) + 2 (1, 0, 0) + 3 (1, 1, 0.5) + 4 (0, 0, -1)) / 10 m
  EXPECT_LT((skeleton.body_centre[0] - Eigen::Vector3d(500.0, 300.0, -240.0)).norm(), 1e-9);
  EXPECT_NEAR(chain.joints[1].mass_kg, 5.0, 1e-12);
}

TEST(UrdfText, AnAxisHasALength) {
  const auto with_axis = [](const std::string& axis) {
    std::string text = joined("");
    return message(text.replace(text.find("0 0 1"), 5, axis));
  };
  EXPECT_EQ(with_axis("0 0 2e-6"), "");
  EXPECT_EQ(with_axis("0 0 1e-7"), "arm.urdf: joint \"j\" has an axis of length 0");
  EXPECT_EQ(with_axis("0 0 0"), "arm.urdf: joint \"j\" has an axis of length 0");
}

// In descending names the last link is destroyed last, and within it all others.
TEST(UrdfText, AsManyLinksAsAreTakenCostNoStackAndMoreAreRefused) {
  const auto chain = [](int links, const std::string& end) {
    std::string text = "<link name=\"r\"/>" + joint("j", "revolute", "r", "k99999");
    for (int k = 0; k < links - 1; ++k) {
      text += fmt::format("<link name=\"k{}\"/>", 99999 - k);
      if (k > 0)
        text += joint(fmt::format("f{}", k), "fixed", fmt::format("k{}", 100000 - k), fmt::format("k{}", 99999 - k));
    }
    return robot(text + end);
  };
  EXPECT_EQ(message(chain(5000, "")), "");
  EXPECT_NE(message(chain(5000, joint("bad", "fixed", "r", "nothing"))).find("[nothing]"), std::string::npos);
  EXPECT_NE(message(chain(5001, "")).find("there are more than 5000 links"), std::string::npos);
}

TEST(UrdfText, AHundredAttributesAreTakenAndMoreAreRefused) {
  const auto with = [](int count) {
    std::string attributes;
    for (int k = 0; k < count; ++k) attributes += fmt::format(" x{}=\"\"", k);
    return message(joined("<a" + attributes + "/>"));
  };
  EXPECT_EQ(with(100), "");
  EXPECT_NE(with(101).find("an element has more than 100 attributes"), std::string::npos) << with(101);
}

TEST(UrdfText, DepthThatIsHiddenFromSimpleCountsIsRefused) {
  const auto deep = [](const std::string& begin, const std::string& end) {
    std::string text = "<robot name=\"r\">\n";
    for (int k = 0; k < 60000; ++k) text += begin;
    for (int k = 0; k < 60000; ++k) text += end;
    return message(text + "</robot>");
  };
  for (const std::string begin :
       {"<a>", "<a x=\"/>\">", "<!-- </a> --><a>", "<a><!-- </a></b> -->", "<a><![CDATA[ </a></b> ]]>", "<a><?p?>"}) {
    EXPECT_NE(deep(begin, "</a>").find("nested deeper than 100"), std::string::npos) << begin;
    EXPECT_NE(deep(begin, "").find("nested deeper than 100"), std::string::npos) << begin;
  }
  EXPECT_NE(deep("<?p ><a> ?>", "").find("a processing instruction holds < or >"), std::string::npos);
  EXPECT_NE(deep("<a/><a/><a/>", "<b/><b/><!---->").find("more than 300000 elements"), std::string::npos);
  for (const std::string each : {"<!---->", "<![CDATA[]]>", "<?p?>"}) {
    std::string many;
    for (int k = 0; k < 300000; ++k) many += each;
    EXPECT_NE(message(joined(many)).find("more than 300000 elements and comments"), std::string::npos) << each;
  }
  const std::string type = "<!DOCTYPE r [<!ENTITY a \"<a><a><a>\">]>";
  EXPECT_EQ(message(type + joined("")), "arm.urdf:1:13: a document type and entities are not for a URDF");
}

TEST(UrdfText, BytesThatAreNoUtf8AreRefused) {
  EXPECT_EQ(message(joined("<link name=\"gr\xF6\xDF"
                           "e\"/>"))
                .find("arm.urdf:4:"),
            0U);
  EXPECT_EQ(message("\xFF\xFE<\0r\0"), "arm.urdf: this is UTF-16, UTF-8 is needed");
}

// urdfdom takes such a mass for 0 and says so only to a log.
TEST(UrdfText, MassesThatAreNoNumbersAreRefused) {
  for (const char* value : {"nan", "inf", "1e400", "", "heavy"}) {
    std::string text = joined("");
    const std::string body = fmt::format(
        "<link name=\"s\"><inertial><mass value=\"{}\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" "
        "iyz=\"0\" izz=\"1\"/></inertial></link>",
        value);
    text.replace(text.find("<link name=\"s\"/>"), 16, body);
    EXPECT_EQ(message(text).find("arm.urdf: link \"s\": the mass cannot be read: "), 0U) << message(text);
  }
}

TEST(UrdfText, LimitsThatAreExchangedOrEqualAreRefused) {
  const auto limited = [](const std::string& limits) {
    std::string text = joined("");
    const std::string usual = "lower=\"-1\" upper=\"2\"";
    return message(text.replace(text.find(usual), usual.size(), limits));
  };
  EXPECT_EQ(
      limited("lower=\"2\" upper=\"-2\""),
      "arm.urdf: joint \"j\" has the lower limit 2 and the upper limit -2: the lower one must be below the upper one");
  EXPECT_EQ(
      limited("lower=\"1\" upper=\"1\""),
      "arm.urdf: joint \"j\" has the lower limit 1 and the upper limit 1: the lower one must be below the upper one");
  EXPECT_EQ(limited("lower=\"0\" upper=\"0\""), "");
}

// 0.2 and 0.05 in rad and m; a chain counts in rad and mm, and offsets in degrees and mm.
TEST(UrdfText, MimicsHaveTheUnitsOfBothJoints) {
  const auto mimic = [](const std::string& leader, const std::string& type) {
    const std::string more = "<mimic joint=\"j\" multiplier=\"0.2\" offset=\"0.05\"/>";
    return *parse_urdf(robot("<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\n" + joint("j", leader, "a", "b") +
                             joint("k", type, "b", "c", more)),
                       "arm.urdf")
                .joints[1]
                .mimic;
  };
  for (const std::string leader : {"revolute", "prismatic"}) {
    const double per_unit = leader == "prismatic" ? 0.001 : 1.0;
    const Mimic turns = mimic(leader, "revolute");
    EXPECT_NEAR(turns.multiplier, 0.2 * per_unit, 1e-15) << leader;
    EXPECT_NEAR(turns.offset, 0.05 * 57.29577951308232, 1e-14) << leader;
    const Mimic slides = mimic(leader, "prismatic");
    EXPECT_NEAR(slides.multiplier, 200.0 * per_unit, 1e-12) << leader;
    EXPECT_NEAR(slides.offset, 50.0, 1e-12) << leader;
  }
}

TEST(UrdfText, LimitsAreKeptAndContinuousJointsHaveNone) {
  const Chain chain = parse_urdf(
      robot("<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/>\n" +
            joint("j", "revolute", "a", "b") + joint("k", "continuous", "b", "c") + joint("l", "prismatic", "c", "d")),
      "arm.urdf");
  ASSERT_TRUE(chain.joints[0].limits.has_value());
  EXPECT_NEAR((*chain.joints[0].limits)[1], 2.0 * 57.29577951308232, 1e-12);
  EXPECT_FALSE(chain.joints[1].limits.has_value());
  EXPECT_EQ((*chain.joints[2].limits)[0], -1000.0);
}

}  // namespace
}  // namespace llmt::robotics
