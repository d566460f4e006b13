#include <gtest/gtest.h>

#include "host/source/v4l2_settings.h"
#include "tests/unit/source/message.h"

namespace tagwrench {
namespace {

V4l2Mode mode(PixelFormat pixels, int width, int height, double fps) {
  return {pixels, 0, width, height, fps, fps};
}

// What a usual webcam offers.
const std::vector<V4l2Mode> kWebcam = {
    mode(PixelFormat::yuyv, 640, 480, 30),  mode(PixelFormat::yuyv, 640, 480, 15),
    mode(PixelFormat::yuyv, 1280, 720, 10), mode(PixelFormat::mjpg, 640, 480, 30),
    mode(PixelFormat::mjpg, 1280, 720, 60), mode(PixelFormat::mjpg, 1920, 1080, 30),
    mode(PixelFormat::yuyv, 1920, 1080, 5),
};

std::string chosen(const std::vector<V4l2Mode>& modes, const V4l2Options& options) {
  const auto choice = choose_mode(modes, options);
  if (!choice) return "none";
  V4l2Mode shown = choice->mode;
  shown.fps_max = choice->fps;
  return describe(shown);
}

V4l2Options request(const char* spec, int width = 640, int height = 480) {
  V4l2Options options = parse_v4l2_spec(spec);
  options.preferred_width = width;
  options.preferred_height = height;
  return options;
}

TEST(ChooseMode, PreferredSizeThenRateThenUncompressed) {
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0")), "640x480 YUYV 30 fps");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0", 1280, 720)), "1280x720 MJPG 60 fps");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0", 1920, 1080)), "1920x1080 MJPG 30 fps");
}

TEST(ChooseMode, WhatIsAskedIsWhatIsGiven) {
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,1280x720")), "1280x720 MJPG 60 fps");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,1280x720@10")), "1280x720 YUYV 10 fps");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,640x480@15")), "640x480 YUYV 15 fps");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,640x480,MJPG")), "640x480 MJPG 30 fps");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,640x480@60")), "none");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,640x481")), "none");
  EXPECT_EQ(chosen(kWebcam, request("/dev/video0,640x480,NV12")), "none");
}

TEST(ChooseMode, NearlyEqualRatesDoNotOutvoteUncompressed) {
  EXPECT_EQ(
      chosen({mode(PixelFormat::mjpg, 640, 480, 30), mode(PixelFormat::yuyv, 640, 480, 29.97)},
             request("/dev/video0")),
      "640x480 YUYV 29.97 fps");
}

TEST(ChooseMode, OfEqualsTheCheapestToDecode) {
  EXPECT_EQ(chosen({mode(PixelFormat::yuyv, 640, 480, 30), mode(PixelFormat::nv12, 640, 480, 30),
                    mode(PixelFormat::grey, 640, 480, 30)},
                   request("/dev/video0")),
            "640x480 GREY 30 fps");
}

TEST(ChooseMode, WithoutThePreferredSizeTheNearest) {
  EXPECT_EQ(chosen({mode(PixelFormat::grey, 320, 240, 120), mode(PixelFormat::grey, 800, 600, 30),
                    mode(PixelFormat::grey, 1920, 1080, 60)},
                   request("/dev/video0")),
            "800x600 GREY 30 fps");
}

TEST(ChooseMode, ARangeOfRatesGivesAnyRateWithin) {
  const std::vector<V4l2Mode> range = {{PixelFormat::grey, 0, 640, 480, 1, 90}};
  EXPECT_EQ(chosen(range, request("/dev/video0")), "640x480 GREY 90 fps");
  EXPECT_EQ(chosen(range, request("/dev/video0,640x480@42")), "640x480 GREY 42 fps");
  EXPECT_EQ(chosen(range, request("/dev/video0,640x480@120")), "none");
}

TEST(ChooseMode, ACameraWithoutModesHasNone) {
  EXPECT_EQ(chosen({}, request("/dev/video0")), "none");
}

TEST(DescribeModes, ListsEachOnceAtItsBestRateAndStaysShort) {
  EXPECT_EQ(describe(kWebcam, 3),
            "640x480 YUYV 30 fps, 640x480 MJPG 30 fps, 1280x720 MJPG 60 fps and 3 more");
}

TEST(ParseSpec, ReadsEveryPart) {
  const V4l2Options options = parse_v4l2_spec("/dev/v4l/by-id/usb-cam-index0,1280x720@29.97,mjpg");
  EXPECT_EQ(options.path, "/dev/v4l/by-id/usb-cam-index0");
  EXPECT_EQ(options.width, 1280);
  EXPECT_EQ(options.height, 720);
  EXPECT_DOUBLE_EQ(options.fps, 29.97);
  EXPECT_EQ(options.pixels, PixelFormat::mjpg);
}

TEST(ParseSpec, LeavesTheRestOpen) {
  const V4l2Options options = parse_v4l2_spec("/dev/video12");
  EXPECT_EQ(options.path, "/dev/video12");
  EXPECT_EQ(options.width, 0);
  EXPECT_EQ(options.fps, 0);
  EXPECT_EQ(options.pixels, std::nullopt);
}

TEST(ParseSpec, QuotesThePartThatIsWrong) {
  const struct {
    const char* spec;
    const char* part;
  } cases[] = {{"", "''"},
               {"video0", "'video0'"},
               {"/dev/video0,", "''"},
               {"/dev/video0,640", "'640'"},
               {"/dev/video0,640x", "'640x'"},
               {"/dev/video0,0x480", "'0x480'"},
               {"/dev/video0,-640x480", "'-640x480'"},
               {"/dev/video0,640x480x3", "'640x480x3'"},
               {"/dev/video0,99999x480", "'99999x480'"},
               {"/dev/video0,640x480@", "'@'"},
               {"/dev/video0,640x480@0", "'@0'"},
               {"/dev/video0,640x480@nan", "'@nan'"},
               {"/dev/video0,640x480@1e9", "'@1e9'"},
               {"/dev/video0,640x480@30fps", "'@30fps'"},
               {"/dev/video0,640x480,H264", "'H264'"},
               {"/dev/video0,640x480,", "''"},
               {"/dev/video0,640x480,GREY,x", "'x'"}};
  for (const auto& c : cases) {
    const std::string message = refusal([&] { parse_v4l2_spec(c.spec); });
    EXPECT_TRUE(names(message, {c.part, "/dev/videoN"})) << c.spec << ": " << message;
  }
}

}  // namespace
}  // namespace tagwrench
