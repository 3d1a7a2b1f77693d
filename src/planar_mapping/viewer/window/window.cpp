// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/window/window.h"

#include <sys/stat.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkGenericRenderWindowInteractor.h>
#include <vtkInteractorStyleTerrain.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>

#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/scene/decorations.h"
#include "planar_mapping/viewer/scene/picking.h"
#include "planar_mapping/viewer/scene/scene.h"
#include "planar_mapping/viewer/window/keys.h"
#include "planar_mapping/viewer/window/render_backend.h"
#include "planar_mapping/viewer/window/snapshot.h"
#include "planar_mapping/viewer/window/x_display.h"

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
  static MapStyle* New();
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
vtkStandardNewMacro(MapStyle);

std::unique_ptr<OffscreenWindow> openOffscreen(Window::Screen screen, const ViewOptions& options) {
  if (screen == Window::Screen::Offscreen)
    return OffscreenWindow::create(options.width, options.height);
  const std::string problem = visualization::xServerProblem();
  if (problem.empty()) return nullptr;
  throw RenderError("no window can be opened: " + problem +
                    "; run it in a desktop session, or write a picture with --snapshot, which "
                    "needs no display");
}

/// A window with its scene, on the screen or off it.
class SceneWindow : public Window {
 public:
  SceneWindow(SceneContent scene_content, const ViewOptions& view_options, Screen screen,
              const std::string& title)
      : content_(std::move(scene_content)),
        options_(view_options),
        offscreen_(openOffscreen(screen, options_)),
        window_(offscreen_ ? offscreen_->window() : vtkRenderWindow::New()),
        scene_(std::make_unique<Scene>(content_)) {
    if (!offscreen_) {
      window_->UnRegister(nullptr);  // the smart pointer holds it now
      window_->SetSize(options_.width, options_.height);
      window_->SetWindowName(title.c_str());
      interactor_.TakeReference(vtkRenderWindowInteractor::New());
    } else {
      interactor_.TakeReference(vtkGenericRenderWindowInteractor::New());
    }
    window_->SetMultiSamples(visualization::kSamplesPerPixel);
    window_->AddRenderer(scene_->renderer());
    interactor_->SetRenderWindow(window_);
    style_->SetDefaultRenderer(scene_->renderer());
    style_->on_key = [this](const std::string& key) { guarded([&] { press(key); }); };
    style_->on_click = [this](int x, int y) {
      guarded([&] { pick(x + 0.5, options_.height - y - 0.5); });
    };
    interactor_->SetInteractorStyle(style_);
    before_render_->SetClientData(this);
    before_render_->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
      static_cast<SceneWindow*>(self)->beforeRender();
    });
    observer_ = window_->AddObserver(vtkCommand::StartEvent, before_render_);
    scene_->show(options_);
    frameContent();
    showOverlay("h: help");
    window_->Render();
    failOnError();
    interactor_->Initialize();
  }

  ~SceneWindow() override {
    window_->RemoveObserver(observer_);
    interactor_->SetInteractorStyle(nullptr);
    window_->RemoveRenderer(scene_->renderer());
    interactor_->SetRenderWindow(nullptr);
    if (!offscreen_) window_->Finalize();
  }

  void setContent(SceneContent other) override {
    other.validate();
    const CameraView view = scene_->camera();
    const bool is_framed = isSame(view, framed_);  // nobody moved the camera
    window_->RemoveRenderer(scene_->renderer());
    scene_.reset();  // it refers to the content
    overlay_.clear();
    content_ = std::move(other);
    scene_ = std::make_unique<Scene>(content_);
    window_->AddRenderer(scene_->renderer());
    style_->SetDefaultRenderer(scene_->renderer());
    scene_->show(options_);
    if (is_framed) {
      frameContent();
    } else {
      scene_->look(view);
    }
    showOverlay(overlay_text_);
    window_->Render();
  }

  void follow(std::function<std::optional<SceneContent>()> source, double period) override {
    next_ = std::move(source);
    on_timer_->SetClientData(this);
    on_timer_->SetCallback([](vtkObject*, unsigned long, void* window, void*) {
      auto* self = static_cast<SceneWindow*>(window);
      self->guarded([self] {
        if (std::optional<SceneContent> other = self->next_()) self->setContent(std::move(*other));
      });
    });
    interactor_->AddObserver(vtkCommand::TimerEvent, on_timer_);
    interactor_->CreateRepeatingTimer(static_cast<unsigned long>(std::lround(1000.0 * period)));
  }

  bool press(const std::string& key) override {
    std::string message;
    const KeyAction action = visualization::applyKey(key, options_, message);
    switch (action) {
      case KeyAction::None:
        return false;
      case KeyAction::PlaceCamera:
        scene_->show(options_);
        frameContent();
        break;
      case KeyAction::ChangeView:
        scene_->show(options_);
        break;
      case KeyAction::ZoomIn:
      case KeyAction::ZoomOut:
        zoom(action == KeyAction::ZoomIn ? 1.25 : 0.8);
        break;
      case KeyAction::Help:
        message = overlay_text_ == Window::keyHelp() ? "" : Window::keyHelp();
        break;
      case KeyAction::Screenshot:
        message = screenshot();
        break;
      case KeyAction::Clear:
        scene_->highlight(-1);
        break;
      case KeyAction::Quit:
        interactor_->TerminateApp();
        return true;
    }
    const bool redrawn = action == KeyAction::ZoomIn || action == KeyAction::ZoomOut;
    if (!redrawn || !message.empty()) showOverlay(message);
    window_->Render();
    return true;
  }

  int pick(double x, double y) override {
    const CameraView view = scene_->camera();
    const int picked = pickCuboid(content_, sightLine(view, options_.width, options_.height, x, y),
                                  view, options_);
    scene_->highlight(picked);
    showOverlay(picked < 0 ? "nothing there" : describeCuboid(content_, picked));
    window_->Render();
    return picked;
  }

  void run() override {
    if (offscreen_) throw RenderError("a window off screen cannot be run; it takes press()");
    interactor_->Start();
  }
  const ViewOptions& options() const override { return options_; }
  CameraView camera() const override { return scene_->camera(); }
  std::string overlayText() const override { return overlay_text_; }
  Image image() override {
    window_->Render();
    return visualization::imageOf(window_);
  }
  void setScreenshotPrefix(const std::string& prefix) override { screenshot_prefix_ = prefix; }
  void sendKey(const std::string& key) override {
    const char character = key.size() == 1 ? key[0] : '\0';
    interactor_->SetKeyEventInformation(0, 0, character, 0, key.c_str());
    interactor_->InvokeEvent(vtkCommand::KeyPressEvent);
    interactor_->InvokeEvent(vtkCommand::CharEvent);
    interactor_->InvokeEvent(vtkCommand::KeyReleaseEvent);
  }
  void sendClick(int x, int y) override {
    interactor_->SetEventInformation(x, options_.height - 1 - y);
    interactor_->InvokeEvent(vtkCommand::LeftButtonPressEvent);
    interactor_->InvokeEvent(vtkCommand::LeftButtonReleaseEvent);
  }
  void sendTimer() override { interactor_->InvokeEvent(vtkCommand::TimerEvent); }

 private:
  static bool isSame(const CameraView& a, const CameraView& b) {
    return a.position == b.position && a.focal_point == b.focal_point && a.view_up == b.view_up &&
           a.view_angle == b.view_angle && a.parallel_scale == b.parallel_scale;
  }

  void frameContent() {
    scene_->look(placeCamera(content_, options_));
    framed_ = scene_->camera();
  }

  // Exceptions must not pass through VTK's event loop: they are shown.
  void guarded(const std::function<void()>& action) {
    try {
      action();
    } catch (const std::exception& error) {
      showOverlay(error.what());
      window_->Render();
    }
  }

  void failOnError() const {
    const std::string error = messages_.firstError();
    if (!error.empty()) throw RenderError("drawing failed: " + error);
  }

  void beforeRender() {
    const int* size = window_->GetSize();
    if (size[0] != options_.width || size[1] != options_.height) {
      options_.width = std::clamp(size[0], 16, 16384);
      options_.height = std::clamp(size[1], 16, 16384);
      scene_->show(options_);
      showOverlay(overlay_text_);
    }
    scene_->cameraMoved();
  }

  void showOverlay(const std::string& text) {
    vtkRenderer* renderer = scene_->renderer();
    for (const auto& prop : overlay_) renderer->RemoveViewProp(prop);
    overlay_.clear();
    overlay_text_ = text;
    if (text.empty()) return;
    const auto lines = 1.0 + static_cast<double>(std::count(text.begin(), text.end(), '\n'));
    std::size_t longest = 0, start = 0;
    while (start <= text.size()) {
      const std::size_t end = std::min(text.find('\n', start), text.size());
      longest = std::max(longest, end - start);
      start = end + 1;
    }
    const double font = std::clamp(0.021 * options_.height, 11.0, 22.0);
    const double height = (1.25 * lines + 1.0) * font;
    const double width = (0.62 * static_cast<double>(longest) + 1.6) * font;
    const double bottom = options_.height - height - 0.8 * font;
    overlay_.push_back(
        visualization::makeRectangle(0.8 * font, bottom, width, height, Color{250, 250, 252}, 0.9));
    overlay_.push_back(
        visualization::makeText(text, 1.6 * font, bottom + 0.7 * font, font, false, true));
    for (const auto& prop : overlay_) renderer->AddViewProp(prop);
  }

  void zoom(double factor) {
    vtkCamera* camera = scene_->renderer()->GetActiveCamera();
    if (camera->GetParallelProjection() != 0) {
      camera->SetParallelScale(camera->GetParallelScale() / factor);
    } else {
      camera->Dolly(factor);
    }
  }

  std::string screenshot() {
    std::array<char, 16> number{};
    for (int i = 1; i <= 999; ++i) {
      std::snprintf(number.data(), number.size(), "_%03d.png", i);
      const std::string path = screenshot_prefix_ + number.data();
      struct stat status {};
      if (::stat(path.c_str(), &status) == 0) continue;
      showOverlay("");
      window_->Render();
      io::writeImage(path, visualization::imageOf(window_));
      return "written: " + path;
    }
    throw IoError(screenshot_prefix_, "has 999 screenshots already");
  }

  CapturedMessages messages_;
  CameraView framed_;  ///< as the program placed the camera last
  SceneContent content_;
  ViewOptions options_;
  std::unique_ptr<OffscreenWindow> offscreen_;
  vtkSmartPointer<vtkRenderWindow> window_;
  std::unique_ptr<Scene> scene_;
  vtkSmartPointer<vtkRenderWindowInteractor> interactor_;
  vtkNew<MapStyle> style_;
  vtkNew<vtkCallbackCommand> before_render_;
  vtkNew<vtkCallbackCommand> on_timer_;
  std::function<std::optional<SceneContent>()> next_;
  unsigned long observer_ = 0;
  Props overlay_;
  std::string overlay_text_;
  std::string screenshot_prefix_ = "planar_map";
};

}  // namespace

std::unique_ptr<Window> openWindow(SceneContent content, const ViewOptions& options,
                                   Window::Screen screen, const std::string& title) {
  content.validate();
  options.validate();
  return std::make_unique<SceneWindow>(std::move(content), options, screen, title);
}

Image renderSnapshot(const SceneContent& content, const ViewOptions& options) {
  content.validate();
  options.validate();
  const CameraView view = placeCamera(content, options);
  visualization::Scene scene(content);
  scene.show(options);
  scene.look(view);
  Image image = visualization::renderOffscreen(options.width, options.height, {scene.renderer()});
  visualization::requireDrawn(image);
  return image;
}

}  // namespace planar_mapping
