// The bridge between runs: jobs that want the camera while it is lent, given back or not yet had,
// and pages that go in the middle of something. A shell script stands for our own program.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/motion/control_socket.h"
#include "host/web/bridge/web_bridge.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

namespace beast = boost::beast;
using nlohmann::json;

class BridgePage {
 public:
  explicit BridgePage(const WebBridge& bridge) : socket_(context_) {
    const std::string url = bridge.url();  // http://127.0.0.1:PORT/
    const std::string port = url.substr(url.rfind(':') + 1, url.size() - url.rfind(':') - 2);
    const std::string host = "127.0.0.1:" + port;
    beast::get_lowest_layer(socket_).connect(
        {boost::asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(std::stoi(port))});
    socket_.set_option(beast::websocket::stream_base::decorator([host](auto& request) {
      request.set(beast::http::field::origin, "http://" + host);
      request.set(beast::http::field::sec_websocket_protocol, "tagwrench.v1");
    }));
    socket_.handshake(host, "/ws");
  }

  void send(const json& request) { socket_.write(boost::asio::buffer(request.dump())); }
  /// The answer.
  json ask(json request) {
    request["id"] = ++id_;
    send(request);
    while (true) {
      const json message = next();
      if (message["type"] == "answer" && message["id"] == id_) return message;
    }
  }
  /// Returns once the job has said something.
  void hear_job() {
    while (true) {
      const json message = next();
      if (message["type"] == "job" && !message["job"]["lines"].empty()) return;
    }
  }
  /// Returns once the bridge has let go of it.
  void leave() {
    beast::error_code error;
    socket_.close(beast::websocket::close_code::normal, error);
    char byte = 0;
    while (!error) socket_.next_layer().read_some(boost::asio::buffer(&byte, 1), error);
  }

 private:
  json next() {
    beast::flat_buffer buffer;
    socket_.read(buffer);
    return json::parse(beast::buffers_to_string(buffer.data()));
  }

  boost::asio::io_context context_;
  beast::websocket::stream<boost::asio::ip::tcp::socket> socket_;
  std::int64_t id_ = 0;
};

const json kZeroJob = {{"ask", "job_start"}, {"verb", "zero"}};

class BridgeRuns : public testing::Test {
 protected:
  BridgeRuns() : stop_(make_event()) {
    ::setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    folder_.write("job", "#!/bin/sh\necho begun >>" + (folder_ / "log").string() +
                             "; echo begun >&2\nread -r end < " + (folder_ / "end").string() +
                             "\n");
    if (::mkfifo((folder_ / "end").c_str(), 0600) != 0) throw std::runtime_error("mkfifo");
    std::filesystem::permissions(folder_ / "job", std::filesystem::perms::owner_all);
    WebBridgeOptions options;
    options.server.port = 0;
    options.recordings = folder_ / "recordings";
    options.program = folder_ / "job";
    bridge_.emplace(options, stop_.get());
    bridge_->start();
    facts_.name = "bridge-test";
    facts_.place.sensor = folder_ / "sensor.yaml";
    facts_.place.source = "sim";
  }

  std::unique_ptr<WebOutput> begin() { return bridge_->begin_run(facts_, {}); }
  /// The loop is told to end, and ends.
  void end_as_wished() {
    pollfd end{bridge_->end_fd(), POLLIN, 0};
    ::poll(&end, 1, -1);
    bridge_->end_run();
  }
  std::future<bool> lend() {
    return std::async(std::launch::async, [this] { return bridge_->lend_camera({}); });
  }
  /// The job waits for this line.
  void end_job() const { std::ofstream(folder_ / "end") << "end\n"; }
  bool begun() const { return std::filesystem::exists(folder_ / "log"); }

  test::TemporaryFolder folder_;
  UniqueFd stop_;
  std::optional<WebBridge> bridge_;
  RunFacts facts_;
};

TEST_F(BridgeRuns, AJobThatIsStartedWhileTheSensorIsBeingSetUpWaitsForThat) {
  BridgePage page(*bridge_);
  begin();
  bridge_->end_run();
  EXPECT_EQ(page.ask(kZeroJob)["ok"], true);
  EXPECT_EQ(page.ask({{"ask", "retry"}})["ok"], false);
  EXPECT_FALSE(begun());
  const auto run = begin();
  EXPECT_FALSE(begun());
  end_as_wished();
  std::future<bool> back = lend();
  page.hear_job();
  end_job();
  EXPECT_TRUE(back.get());
}

TEST_F(BridgeRuns, TheCameraComesBackWhenTheJobIsOverAndNotBefore) {
  BridgePage page(*bridge_);
  const auto run = begin();
  EXPECT_EQ(page.ask(kZeroJob)["ok"], true);
  EXPECT_FALSE(begun());
  end_as_wished();
  std::future<bool> back = lend();
  page.hear_job();
  EXPECT_EQ(back.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  end_job();
  EXPECT_TRUE(back.get());
}

TEST_F(BridgeRuns, AJobIsDoneAllTheSameWhenTheRunThatItWaitedForFails) {
  BridgePage page(*bridge_);
  const auto run = begin();
  EXPECT_EQ(page.ask(kZeroJob)["ok"], true);
  end_as_wished();
  std::future<bool> back = std::async(
      std::launch::async, [this] { return bridge_->wait_after("the disk is full", {}); });
  page.hear_job();
  end_job();
  EXPECT_TRUE(back.get());
}

/// Whoever it was cannot keep it, nor end it.
TEST_F(BridgeRuns, ATrialOfAPageThatIsGoneByThenIsTakenBack) {
  facts_.profiles = true;
  ControlSocket profiles(control_path(facts_.name));
  using Kind = ControlRequest::Kind;
  const auto next = [&profiles] {  // that is no mere look at what there is
    while (true) {
      pollfd request{profiles.fd(), POLLIN, 0};
      ::poll(&request, 1, -1);
      const Kind kind = profiles.next().kind;
      if (kind != Kind::none && kind != Kind::status && kind != Kind::show) return kind;
      profiles.answer("error: not now\n");
    }
  };
  const auto run = begin();
  BridgePage stays(*bridge_);
  BridgePage goes(*bridge_);
  goes.send({{"id", 1}, {"ask", "try"}, {"name", "cad"}, {"text", "name: cad\n"}});
  EXPECT_EQ(next(), Kind::attempt);
  goes.leave();
  stays.ask({{"ask", "recordings"}});
  profiles.answer("ok: on trial\n");
  EXPECT_EQ(next(), Kind::revert);
}

}  // namespace
}  // namespace tagwrench
