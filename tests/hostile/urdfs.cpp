// URDFs and mechanisms.
#include <fmt/format.h>

#include "hostile/lists.hpp"

namespace hostile {
namespace {

std::string link(const std::string& name, const std::string& mass = "2") {
  return fmt::format(
      "<link name=\"{}\"><inertial><mass value=\"{}\"/><origin xyz=\"0 0 0.1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
      "iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\n",
      name, mass);
}

std::string bare(const std::string& name) { return fmt::format("<link name=\"{}\"/>\n", name); }

struct Extras {
  std::string type = "revolute";
  std::string origin = "xyz=\"0 0.3 0.1\" rpy=\"1.5 0 0.2\"";
  std::string axis = "0 0 1";
  std::string more = "<limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"1\"/>";
};

std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const Extras& extras = {}) {
  return fmt::format(
      "<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/><origin {}/><axis "
      "xyz=\"{}\"/>{}</joint>\n",
      name, extras.type, parent, child, extras.origin, extras.axis, extras.more);
}

std::string fixed(const std::string& name, const std::string& parent, const std::string& child) {
  return fmt::format("<joint name=\"{}\" type=\"fixed\"><parent link=\"{}\"/><child link=\"{}\"/></joint>\n", name,
                     parent, child);
}

std::string robot(const std::string& inside, const std::string& name = "arm") {
  return fmt::format("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n{}</robot>\n", name, inside);
}

std::string arm(const Extras& second = {}, const std::string& name = "arm") {
  return robot(link("l0") + link("l1") + link("l2") + link("l3") + joint("j1", "l0", "l1") +
                   joint("j2", "l1", "l2", second) + joint("j3", "l2", "l3"),
               name);
}

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (int k = 0; k < count; ++k) result += text;
  return result;
}

std::string chain(int links, bool moves) {
  std::string text = bare("r");
  for (int k = 0; k < links; ++k) {
    const std::string parent = k == 0 ? "r" : fmt::format("k{}", k - 1);
    const std::string child = fmt::format("k{}", k);
    text += bare(child) + (moves || k == 0 ? joint(fmt::format("j{}", k), parent, child)
                                           : fixed(fmt::format("j{}", k), parent, child));
  }
  return robot(text);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string mechanism(const std::string& definitions, const std::string& equation) {
  return "mechanism: m\nparameters:\n  - {name: r, value_mm: 50}\njoints:\n  - {name: q, start_deg: 60, limits_deg: "
         "[0, "
         "170]}\noutputs:\n  - {name: x, start_mm: 25}\n" +
         definitions + "equations:\n  - " + equation + "\n";
}

}  // namespace

void ask_urdfs(List& list, const std::string& robot_program) {
  const auto ask = [&](const std::string& name, const std::string& text, const std::vector<std::string>& more = {}) {
    write("evil.urdf", text);
    std::vector<std::string> command = {robot_program, "simulate", "evil.urdf", "--poses", "3"};
    command.insert(command.end(), more.begin(), more.end());
    list.ask(name, command, "evil.urdf");
  };
  const std::string good = bare("r") + bare("s") + joint("j0", "r", "s");
  const std::string loop = bare("a") + bare("b") + joint("j1", "a", "b") + joint("j2", "b", "a");
  constexpr int many = 60000;
  ask("an arm", arm());
  ask("a loop alone", robot(bare("r") + loop));
  ask("a loop with a leaf", robot(bare("r") + loop + bare("c") + joint("j3", "a", "c")));
  ask("a loop beside an arm", robot(good + loop + bare("c") + joint("j3", "a", "c")));
  ask("a loop, tip in it", robot(good + loop), {"--tip-link", "a"});
  ask("a loop, base in it", robot(good + loop), {"--base-link", "a", "--tip-link", "s"});
  ask("a loop that hangs at the arm", robot(good + loop + fixed("j3", "s", "a")));
  ask("a link that is its own child", robot(good + bare("b") + joint("j1", "b", "b")));
  ask("a link with two parents", robot(good + bare("b") + joint("j1", "s", "b") + joint("j2", "r", "b")));
  ask("two links of one name", robot(good + bare("s")));
  ask("a joint without a link", robot(bare("r") + joint("j0", "r", "a")));
  ask("5000 links, fixed", chain(4999, false));
  ask("60000 links, fixed", chain(many, false));
  ask("60000 links that move", chain(many, true));
  ask("400000 empty joints", robot(repeated("<joint name=\"j\"/>\n", 400000)));
  for (const std::string begin :
       {"<a>", "<a x=\"/>\">", "<!-- </a> --><a>", "<a><!-- </a></b> -->", "<a><![CDATA[ </a></b> ]]>", "<a x=/>"}) {
    ask("60000 levels of " + begin, "<robot name=\"a\">" + repeated(begin, many) + repeated("</a>", many) + "</robot>");
    ask("60000 open " + begin, "<robot name=\"a\">" + repeated(begin, many));
  }
  ask("brackets in an instruction", "<robot name=\"a\">" + repeated("<?p ><a> ?>", many) + "</robot>");
  ask("one million attributes", [] {
    std::string text = "<robot name=\"a\" ";
    for (int k = 0; k < 1000000; ++k) text += fmt::format("a{}='' ", k);
    return text + "/>";
  }());
  ask("entities", "<!DOCTYPE r [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;\">]>" + arm({}, "&b;"));
  ask("an entity of a file", "<!DOCTYPE r [<!ENTITY x SYSTEM \"file:///etc/passwd\">]>" + arm({}, "&x;"));
  for (const char* origin : {"xyz=\"nan 0 0\"", "xyz=\"1e400 0 0\"", "xyz=\"1e308 1e308 1e308\"", "xyz=\"1 2\"",
                             "rpy=\"inf 0 0\"", "quat_xyzw=\"0 0 0 0\""}) {
    ask(fmt::format("origin {}", origin), arm({.origin = origin}));
  }
  for (const char* axis : {"0 0 0", "nan 0 1", "1e300 1e300 0"}) ask(fmt::format("axis {}", axis), arm({.axis = axis}));
  for (const char* limits :
       {"lower=\"nan\" upper=\"1\"", "lower=\"-1e308\" upper=\"1e308\"", "lower=\"2\" upper=\"-2\""}) {
    ask(fmt::format("limits {}", limits),
        arm({.more = fmt::format("<limit {} effort=\"1\" velocity=\"1\"/>", limits)}));
  }
  for (const char* mass : {"nan", "inf", "-5", "1e308", "1e400", ""}) {
    ask(fmt::format("mass \"{}\"", mass), replaced(arm(), "mass value=\"2\"", fmt::format("mass value=\"{}\"", mass)));
  }
  ask("a joint that mimics itself", arm({.more = Extras().more + "<mimic joint=\"j2\"/>"}));
  ask("a robot's name of 1 MB", arm({}, std::string(1000000, 'n')));
  ask("UTF-16", "\xFF\xFE<");
  ask("Latin-1", arm({}, "gr\xF6\xDF\x65"));
  ask("nothing", "");
  ask("17 MB", arm() + std::string(17000000, ' '));
  ask("a mesh without end",
      replaced(arm(), "<link name=\"l1\">",
               "<link name=\"l1\"><visual><geometry><mesh filename=\"file:///dev/zero\"/></geometry>"
               "</visual>"));
}

void ask_mechanisms(List& list, const std::string& robot_program) {
  const auto ask = [&](const std::string& name, const std::string& text) {
    write("evil.yaml", text);
    list.ask(name, {robot_program, "mechanism", "evil.yaml", "--simulate", "3"}, "evil.yaml");
  };
  std::string definitions = "definitions:\n  a0: q\n";
  for (int k = 1; k < 100000; ++k) definitions += fmt::format("  a{}: a{}+1\n", k, k - 1);
  std::string laughs = "definitions:\n  a0: q\n";
  for (int k = 1; k < 200; ++k) laughs += fmt::format("  a{0}: a{1}+a{1}+a{1}\n", k, k - 1);
  ask("a crank", mechanism("", "r*cos(q) = x"));
  ask("100000 definitions", mechanism(definitions, "r*cos(a99999) = x"));
  ask("definitions that treble", mechanism(laughs, "r*cos(a199/1e99) = x"));
  ask("a definition of itself", mechanism("definitions:\n  c: cos(q) + c\n", "r*c = x"));
  ask("no solution", mechanism("", "x = 100*r + q*0"));
  ask("division by zero", mechanism("", "x = 1/0*r*cos(q)"));
  ask("2000 functions deep", mechanism("", "x = r*cos(q)+" + repeated("sin(", 2000) + "0" + repeated(")", 2000)));
  ask("an assignment", mechanism("", "x := r*cos(q)"));
  ask("a limit of nan", replaced(mechanism("", "r*cos(q) = x"), "[0, 170]", "[.nan, 1]"));
  list.ask("/dev/zero", {robot_program, "mechanism", "/dev/zero", "--simulate", "3"}, "/dev/zero");
}

}  // namespace hostile
