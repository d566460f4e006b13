#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <sstream>

#include "host/core/os/unique_fd.h"
#include "host/output/spnav_daemon.h"
#include "host/tools/doctor/doctor.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

using test::TemporaryFolder;

UniqueFd listener(const std::string& path) {
  UniqueFd made(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  if (::bind(made.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(made.get(), 4) != 0)
    throw std::runtime_error(path);
  return made;
}

std::string said(const SpnavFacts& facts) {
  std::ostringstream out;
  Report report(out);
  say_spnav(report, facts);
  return out.str();
}

TEST(DoctorSpnav, TellsWhoServesASocketFromALeftOver) {
  const TemporaryFolder folder;
  EXPECT_EQ(server_at(folder / "spnav.sock"), SpnavServer::none);
  folder.write("touched.sock", "");
  EXPECT_EQ(server_at(folder / "touched.sock"), SpnavServer::silent);

  const UniqueFd spacenavd = listener((folder / "other.sock").string());
  EXPECT_EQ(server_at(folder / "other.sock"), SpnavServer::other);

  const auto daemon = listen_spnav((folder / "ours.sock").string());
  ASSERT_TRUE(daemon);
  EXPECT_EQ(server_at(folder / "ours.sock"), SpnavServer::tagwrench);

  { const UniqueFd gone = listener((folder / "gone.sock").string()); }
  EXPECT_EQ(server_at(folder / "gone.sock"), SpnavServer::silent) << "its owner was killed";
  EXPECT_EQ(server_at(folder / std::string(200, 'x')), SpnavServer::none);
}

TEST(DoctorSpnav, ASystemSocketOfOursIsNotTakenForALeftOver) {
  SpnavFacts facts;
  facts.system = SpnavServer::tagwrench;
  EXPECT_TRUE(said(facts).starts_with("ok  ")) << said(facts);
  EXPECT_EQ(said(facts).find("apt install"), std::string::npos);
}

TEST(DoctorSpnav, WithoutAnyServerItSaysWhatToInstallOrRun) {
  const std::string text = said({});
  EXPECT_TRUE(text.starts_with("--  spacenavd does not run")) << text;
  EXPECT_NE(text.find("apt install spacenavd"), std::string::npos);
}

TEST(DoctorSpnav, AServerThatDoesNotAnswerIsAProblem) {
  SpnavFacts facts;
  facts.spacenavd = 41;
  facts.system = SpnavServer::silent;
  EXPECT_TRUE(said(facts).starts_with("!!  spacenavd runs (pid 41) but does not answer"))
      << said(facts);
  facts.system = SpnavServer::other;
  EXPECT_TRUE(said(facts).starts_with("ok  spacenavd runs (pid 41)")) << said(facts);
}

TEST(DoctorSpnav, OwnSocketIsNamedAndAWrongVariableIsAProblem) {
  SpnavFacts facts;
  facts.own_path = "/run/user/7/tagwrench/spnav.sock";
  facts.own = SpnavServer::tagwrench;
  EXPECT_NE(said(facts).find("SPNAV_SOCKET is not set here"), std::string::npos) << said(facts);
  facts.system = SpnavServer::other;
  EXPECT_EQ(said(facts).find("not set"), std::string::npos) << "spacenavd does it";
  facts.chosen_path = facts.own_path;
  facts.chosen = SpnavServer::tagwrench;
  EXPECT_EQ(said(facts).find("not set"), std::string::npos) << said(facts);
  EXPECT_EQ(said(facts).find("!!"), std::string::npos) << said(facts);
  facts.chosen_path = "/elsewhere";
  facts.chosen = SpnavServer::none;
  EXPECT_NE(said(facts).find("!!  SPNAV_SOCKET=/elsewhere"), std::string::npos) << said(facts);
}

TEST(DoctorSandboxes, EveryProgramThatCannotSeeTheSocketHasAdvice) {
  const TemporaryFolder folder;
  EXPECT_TRUE(sandboxed_programs({folder / "flatpak"}, folder / "snap").empty());
  folder.write("flatpak/org.freecad.FreeCAD/current", "");
  folder.write("mine/org.blender.Blender/current", "");
  folder.write("snap/blender/current", "");
  const auto found = sandboxed_programs({folder / "flatpak", folder / "mine"}, folder / "snap");
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].name, "FreeCAD of flatpak");
  EXPECT_NE(found[0].advice.find("org.freecad.FreeCAD"), std::string::npos);
  EXPECT_EQ(found[1].name, "Blender of flatpak");
  EXPECT_EQ(found[2].name, "Blender of snap");
}

}  // namespace
}  // namespace tagwrench
