// What a game sees of the joystick, through SDL. Runs until it is killed; prints
//   joystick AXES BUTTONS NAME
//   gone NAME
//   axis TIME_ns NUMBER VALUE        (-32768..32767)
#include <SDL.h>

#include <map>

#include "tests/kernel/guest/lines.h"

namespace {

bool is_ours(SDL_JoystickID id, const std::map<SDL_JoystickID, SDL_Joystick*>& open) {
  return open.find(id) != open.end();
}

void watch(const std::string& name_part) {
  std::map<SDL_JoystickID, SDL_Joystick*> open;
  SDL_Event event;
  while (SDL_WaitEvent(&event) != 0) {
    if (event.type == SDL_JOYDEVICEADDED) {
      const char* name = SDL_JoystickNameForIndex(event.jdevice.which);
      if (name == nullptr || std::string(name).find(name_part) == std::string::npos) continue;
      SDL_Joystick* joystick = SDL_JoystickOpen(event.jdevice.which);
      if (joystick == nullptr) tagwrench::rig::fail(std::string(name) + ": " + SDL_GetError());
      open[SDL_JoystickInstanceID(joystick)] = joystick;
      std::printf("joystick %d %d %s\n", SDL_JoystickNumAxes(joystick),
                  SDL_JoystickNumButtons(joystick), name);
    } else if (event.type == SDL_JOYDEVICEREMOVED && is_ours(event.jdevice.which, open)) {
      SDL_Joystick* joystick = open[event.jdevice.which];
      std::printf("gone %s\n", SDL_JoystickName(joystick));
      SDL_JoystickClose(joystick);
      open.erase(event.jdevice.which);
    } else if (event.type == SDL_JOYAXISMOTION && is_ours(event.jaxis.which, open)) {
      std::printf("axis %lld %d %d\n", static_cast<long long>(tagwrench::rig::now_ns()),
                  event.jaxis.axis, event.jaxis.value);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) tagwrench::rig::fail("usage: sdl_client PART_OF_NAME");
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  if (SDL_Init(SDL_INIT_JOYSTICK | SDL_INIT_VIDEO) != 0) {
    tagwrench::rig::fail(std::string("SDL: ") + SDL_GetError());
  }
  std::puts("ready");
  watch(argv[1]);
  tagwrench::rig::fail(std::string("SDL: ") + SDL_GetError());
}
