// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/window.h"

#include <sys/stat.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkGenericRenderWindowInteractor.h>
#include <vtkInteractorStyleTerrain.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/visualization/picking.h"
#include "scene/legend.h"
#include "scene/scene.h"
#include "window/keys.h"
#include "window/render_backend.h"
#include "window/window_image.h"

namespace planar_mapping {

namespace {

using visualization::CapturedMessages;
using visualization::KeyAction;
using visualization::OffscreenWindow;
using visualization::Props;
using visualization::Scene;

constexpr int kClickSlack = 4;  // pixels the mouse may move between press and release

// Keeps the map's up axis upright; keys and clicks go to the window.
class MapStyle : public vtkInteractorStyleTerrain {
 public:
  static MapStyle* New() {
    auto* style = new MapStyle;
    style->InitializeObjectBase();
    return style;
  }
  std::function<void(const std::string&)> on_key;
  std::function<void(int, int)> on_click;  // pixels from the lower left corner

  void OnChar() override {}  // VTK's own keys would quit, or draw wireframes
  void OnKeyPress() override {
    const char* key = this->Interactor->GetKeySym();
    if (key != nullptr && on_key) on_key(key);
  }
  void OnLeftButtonDown() override {
    this->Interactor->GetEventPosition(pressed_.data());
    vtkInteractorStyleTerrain::OnLeftButtonDown();
  }
  void OnLeftButtonUp() override {
    vtkInteractorStyleTerrain::OnLeftButtonUp();
    std::array<int, 2> released = {0, 0};
    this->Interactor->GetEventPosition(released.data());
    const bool still = std::abs(released[0] - pressed_[0]) <= kClickSlack &&
                       std::abs(released[1] - pressed_[1]) <= kClickSlack;
    if (still && on_click) on_click(released[0], released[1]);
  }

 private:
  std::array<int, 2> pressed_ = {0, 0};
};

std::unique_ptr<OffscreenWindow> openOffscreen(Window::Screen screen, const ViewOptions& options) {
  if (screen == Window::Screen::Offscreen) {
    return OffscreenWindow::create(options.width, options.height);
  }
  const std::string problem = visualization::xServerProblem();
  if (problem.empty()) return nullptr;
  throw RenderError("no window can be opened: " + problem +
                    "; run it in a desktop session, or write a picture with --snapshot, which "
                    "needs no display");
}

}  // namespace

struct Window::Impl {
  Impl(SceneContent scene_content, const ViewOptions& view_options, Screen screen,
       const std::string& title)
      : content(std::move(scene_content)),
        options(view_options),
        offscreen(openOffscreen(screen, options)),
        window(offscreen ? offscreen->window() : vtkRenderWindow::New()),
        scene(std::make_unique<Scene>(content)) {
    if (!offscreen) {
      window->UnRegister(nullptr);  // the smart pointer holds it now
      window->SetSize(options.width, options.height);
      window->SetWindowName(title.c_str());
      interactor.TakeReference(vtkRenderWindowInteractor::New());
    } else {
      interactor.TakeReference(vtkGenericRenderWindowInteractor::New());
    }
    window->SetMultiSamples(visualization::kSamplesPerPixel);
    window->AddRenderer(scene->renderer());
    interactor->SetRenderWindow(window);
    style->SetDefaultRenderer(scene->renderer());
    style->on_key = [this](const std::string& key) { guarded([&] { press(key); }); };
    style->on_click = [this](int x, int y) {
      guarded([&] { pick(x + 0.5, options.height - y - 0.5); });
    };
    interactor->SetInteractorStyle(style);
    before_render->SetClientData(this);
    before_render->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
      static_cast<Impl*>(self)->beforeRender();
    });
    observer = window->AddObserver(vtkCommand::StartEvent, before_render);
    scene->show(options);
    scene->look(placeCamera(content, options));
    showOverlay("h: help");
    window->Render();
    failOnError();
    interactor->Initialize();
  }

  ~Impl() {
    window->RemoveObserver(observer);
    interactor->SetInteractorStyle(nullptr);
    window->RemoveRenderer(scene->renderer());
    interactor->SetRenderWindow(nullptr);
    if (!offscreen) window->Finalize();
  }

  // Exceptions must not pass through VTK's event loop: they are shown.
  void guarded(const std::function<void()>& action) {
    try {
      action();
    } catch (const std::exception& error) {
      showOverlay(error.what());
      window->Render();
    }
  }

  void failOnError() const {
    const std::string error = messages.firstError();
    if (!error.empty()) throw RenderError("drawing failed: " + error);
  }

  void beforeRender() {
    const int* size = window->GetSize();
    if (size[0] != options.width || size[1] != options.height) {
      options.width = std::clamp(size[0], 16, 16384);
      options.height = std::clamp(size[1], 16, 16384);
      scene->show(options);
      showOverlay(overlay_text);
    }
    scene->cameraMoved();
  }

  void showOverlay(const std::string& text) {
    vtkRenderer* renderer = scene->renderer();
    for (const auto& prop : overlay) renderer->RemoveViewProp(prop);
    overlay.clear();
    overlay_text = text;
    if (text.empty()) return;
    const auto lines = 1.0 + static_cast<double>(std::count(text.begin(), text.end(), '\n'));
    std::size_t longest = 0, start = 0;
    while (start <= text.size()) {
      const std::size_t end = std::min(text.find('\n', start), text.size());
      longest = std::max(longest, end - start);
      start = end + 1;
    }
    const double font = std::clamp(0.021 * options.height, 11.0, 22.0);
    const double height = (1.25 * lines + 1.0) * font;
    const double width = (0.62 * static_cast<double>(longest) + 1.6) * font;
    const double bottom = options.height - height - 0.8 * font;
    overlay.push_back(
        visualization::makeRectangle(0.8 * font, bottom, width, height, Color{250, 250, 252}, 0.9));
    overlay.push_back(
        visualization::makeText(text, 1.6 * font, bottom + 0.7 * font, font, false, true));
    for (const auto& prop : overlay) renderer->AddViewProp(prop);
  }

  void setContent(SceneContent other) {
    other.validate();
    const CameraView view = scene->camera();
    window->RemoveRenderer(scene->renderer());
    scene.reset();  // it refers to the content
    overlay.clear();
    content = std::move(other);
    scene = std::make_unique<Scene>(content);
    window->AddRenderer(scene->renderer());
    style->SetDefaultRenderer(scene->renderer());
    scene->show(options);
    scene->look(view);
    showOverlay(overlay_text);
    window->Render();
  }

  void follow(std::function<std::optional<SceneContent>()> source, double period) {
    next = std::move(source);
    on_timer->SetClientData(this);
    on_timer->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
      auto* impl = static_cast<Impl*>(self);
      impl->guarded([impl] {
        if (std::optional<SceneContent> other = impl->next()) impl->setContent(std::move(*other));
      });
    });
    interactor->AddObserver(vtkCommand::TimerEvent, on_timer);
    interactor->CreateRepeatingTimer(static_cast<unsigned long>(std::lround(1000.0 * period)));
  }

  bool press(const std::string& key) {
    std::string message;
    const KeyAction action = visualization::applyKey(key, options, message);
    switch (action) {
      case KeyAction::None:
        return false;
      case KeyAction::PlaceCamera:
        scene->show(options);
        scene->look(placeCamera(content, options));
        break;
      case KeyAction::ChangeView:
        scene->show(options);
        break;
      case KeyAction::ZoomIn:
      case KeyAction::ZoomOut:
        zoom(action == KeyAction::ZoomIn ? 1.25 : 0.8);
        break;
      case KeyAction::Help:
        message = overlay_text == Window::keyHelp() ? "" : Window::keyHelp();
        break;
      case KeyAction::Screenshot:
        message = screenshot();
        break;
      case KeyAction::Clear:
        scene->highlight(-1);
        break;
      case KeyAction::Quit:
        interactor->TerminateApp();
        return true;
    }
    const bool redrawn = action == KeyAction::ZoomIn || action == KeyAction::ZoomOut;
    if (!redrawn || !message.empty()) showOverlay(message);
    window->Render();
    return true;
  }

  void zoom(double factor) {
    vtkCamera* camera = scene->renderer()->GetActiveCamera();
    if (camera->GetParallelProjection() != 0) {
      camera->SetParallelScale(camera->GetParallelScale() / factor);
    } else {
      camera->Dolly(factor);
    }
  }

  int pick(double x, double y) {
    const CameraView view = scene->camera();
    const int picked =
        pickCuboid(content, sightLine(view, options.width, options.height, x, y), view, options);
    scene->highlight(picked);
    showOverlay(picked < 0 ? "nothing there" : describeCuboid(content, picked));
    window->Render();
    return picked;
  }

  std::string screenshot() {
    std::array<char, 16> number{};
    for (int i = 1; i <= 999; ++i) {
      std::snprintf(number.data(), number.size(), "_%03d.png", i);
      const std::string path = screenshot_prefix + number.data();
      struct stat status {};
      if (::stat(path.c_str(), &status) == 0) continue;
      showOverlay("");
      window->Render();
      writePng(visualization::imageOf(window), path, false);
      return "written: " + path;
    }
    throw IoError(screenshot_prefix, "has 999 screenshots already");
  }

  CapturedMessages messages;
  SceneContent content;
  ViewOptions options;
  std::unique_ptr<OffscreenWindow> offscreen;
  vtkSmartPointer<vtkRenderWindow> window;
  std::unique_ptr<Scene> scene;
  vtkSmartPointer<vtkRenderWindowInteractor> interactor;
  vtkNew<MapStyle> style;
  vtkNew<vtkCallbackCommand> before_render;
  vtkNew<vtkCallbackCommand> on_timer;
  std::function<std::optional<SceneContent>()> next;
  unsigned long observer = 0;
  Props overlay;
  std::string overlay_text;
  std::string screenshot_prefix = "planar_map";
};

Window::Window(SceneContent content, const ViewOptions& options, Screen screen,
               const std::string& title) {
  content.validate();
  options.validate();
  impl_ = std::make_unique<Impl>(std::move(content), options, screen, title);
}

Window::~Window() = default;

void Window::run() {
  if (impl_->offscreen) throw RenderError("a window off screen cannot be run; it takes press()");
  impl_->interactor->Start();
}

void Window::setContent(SceneContent content) {
  impl_->setContent(std::move(content));
}

void Window::follow(std::function<std::optional<SceneContent>()> next, double period) {
  impl_->follow(std::move(next), period);
}

bool Window::press(const std::string& key) {
  return impl_->press(key);
}

int Window::pick(double x, double y) {
  return impl_->pick(x, y);
}

const ViewOptions& Window::options() const {
  return impl_->options;
}

CameraView Window::camera() const {
  return impl_->scene->camera();
}

std::string Window::overlayText() const {
  return impl_->overlay_text;
}

Image Window::image() {
  impl_->window->Render();
  return visualization::imageOf(impl_->window);
}

void Window::setScreenshotPrefix(const std::string& prefix) {
  impl_->screenshot_prefix = prefix;
}

void Window::sendKey(const std::string& key) {
  const char character = key.size() == 1 ? key[0] : '\0';
  impl_->interactor->SetKeyEventInformation(0, 0, character, 0, key.c_str());
  impl_->interactor->InvokeEvent(vtkCommand::KeyPressEvent);
  impl_->interactor->InvokeEvent(vtkCommand::CharEvent);
  impl_->interactor->InvokeEvent(vtkCommand::KeyReleaseEvent);
}

void Window::sendClick(int x, int y) {
  impl_->interactor->SetEventInformation(x, impl_->options.height - 1 - y);
  impl_->interactor->InvokeEvent(vtkCommand::LeftButtonPressEvent);
  impl_->interactor->InvokeEvent(vtkCommand::LeftButtonReleaseEvent);
}

void Window::sendTimer() {
  impl_->interactor->InvokeEvent(vtkCommand::TimerEvent);
}

std::string Window::keyHelp() {
  return visualization::keyTable();
}

void showWindow(SceneContent content, const ViewOptions& options, const std::string& title) {
  Window(std::move(content), options, Window::Screen::Display, title).run();
}

}  // namespace planar_mapping
