// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/window/render_backend.h"

#include <GL/glew.h>
// EGL after glew.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVersionMacros.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>

#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/window/x_display.h"

namespace planar_mapping::visualization {
namespace {

// libEGL is opened by hand: without it the library still loads, and says what is missing.
struct EglFunctions {
  PFNEGLGETPROCADDRESSPROC getProcAddress = nullptr;
  PFNEGLINITIALIZEPROC initialize = nullptr;
  PFNEGLTERMINATEPROC terminate = nullptr;
  PFNEGLBINDAPIPROC bindApi = nullptr;
  PFNEGLCHOOSECONFIGPROC chooseConfig = nullptr;
  PFNEGLCREATECONTEXTPROC createContext = nullptr;
  PFNEGLDESTROYCONTEXTPROC destroyContext = nullptr;
  PFNEGLMAKECURRENTPROC makeCurrent = nullptr;
  PFNEGLGETCURRENTCONTEXTPROC getCurrentContext = nullptr;
  PFNEGLGETPLATFORMDISPLAYEXTPROC getPlatformDisplay = nullptr;

  bool load() {
    void* library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);  // stays open, as Mesa wants
    if (library == nullptr) return false;
    const auto find = [library](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
      return function != nullptr;
    };
    if (!find(getProcAddress, "eglGetProcAddress") || !find(initialize, "eglInitialize") ||
        !find(terminate, "eglTerminate") || !find(bindApi, "eglBindAPI") ||
        !find(chooseConfig, "eglChooseConfig") || !find(createContext, "eglCreateContext") ||
        !find(destroyContext, "eglDestroyContext") ||
        !find(getCurrentContext, "eglGetCurrentContext") || !find(makeCurrent, "eglMakeCurrent")) {
      return false;
    }
    getPlatformDisplay = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        getProcAddress("eglGetPlatformDisplayEXT"));
    return getPlatformDisplay != nullptr;
  }
};

class EglContext {
 public:
  EglContext() = default;
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  ~EglContext() {
    if (display_ == EGL_NO_DISPLAY) return;
    egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT) egl_.destroyContext(display_, context_);
    // The display belongs to the process: terminating it would end the others' contexts, too.
    if (--users() == 0) egl_.terminate(display_);
  }

  bool open() {
    if (!egl_.load()) return false;
    display_ = egl_.getPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA,
                                       reinterpret_cast<void*>(EGL_DEFAULT_DISPLAY), nullptr);
    if (display_ == EGL_NO_DISPLAY) return false;
    if (egl_.initialize(display_, nullptr, nullptr) != EGL_TRUE) {
      display_ = EGL_NO_DISPLAY;
      return false;
    }
    ++users();
    if (egl_.bindApi(EGL_OPENGL_API) != EGL_TRUE) return false;
    const std::array<EGLint, 5> wanted = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                          EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (egl_.chooseConfig(display_, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1)
      return false;
    const std::array<EGLint, 7> version = {EGL_CONTEXT_MAJOR_VERSION,
                                           3,
                                           EGL_CONTEXT_MINOR_VERSION,
                                           2,
                                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                           EGL_NONE};
    context_ = egl_.createContext(display_, config, EGL_NO_CONTEXT, version.data());
    return context_ != EGL_NO_CONTEXT && makeCurrent();
  }
  bool makeCurrent() {
    return egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE;
  }
  bool isCurrent() const { return egl_.getCurrentContext() == context_; }

 private:
  static std::atomic<int>& users() {
    static std::atomic<int> count{0};
    return count;
  }

  EglFunctions egl_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

// VTK's window for a context that somebody else made.
class EglRenderWindow : public vtkGenericOpenGLRenderWindow {
 public:
  static EglRenderWindow* New();
  EglContext* context = nullptr;

  // Several of them may be alive: a window off screen and a snapshot.
  void MakeCurrent() override {
    if (context != nullptr) context->makeCurrent();
  }
  bool IsCurrent() override { return context != nullptr && context->isCurrent(); }

#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 4, 0)
  // Debian's GLEW knows GLX only: it loads every function and then reports that it found no GLX
  // display (4 = GLEW_ERROR_NO_GLX_DISPLAY), which VTK takes for a failure.
  void OpenGLInitContext() override {
    if (!this->Initialized) {
      const GLenum result = glewInit();
      if (result == GLEW_OK || result == 4u) {
        this->GlewInitValid = true;
        this->Initialized = true;
        this->MaximumHardwareLineWidth = 1.0;
      }
    }
    this->Superclass::OpenGLInitContext();
  }
#endif
};
vtkStandardNewMacro(EglRenderWindow);

class EglOffscreen : public OffscreenWindow {
 public:
  bool open(int width, int height) {
    if (!context_.open()) return false;
    window_ = vtkSmartPointer<EglRenderWindow>::New();
    window_->context = &context_;
    window_->SetOffScreenRendering(1);
    window_->SetReadyForRendering(true);
    window_->SetIsCurrent(true);
    window_->SetSupportsOpenGL(true);
    window_->SetSize(width, height);
    return true;
  }
  ~EglOffscreen() override {
    if (!window_) return;
    context_.makeCurrent();
    window_->Finalize();
    window_->context = nullptr;  // VTK may hold the window a little longer
    window_ = nullptr;
  }
  vtkRenderWindow* window() override { return window_; }
  std::string name() const override { return "EGL"; }

 private:
  EglContext context_;
  vtkSmartPointer<EglRenderWindow> window_;
};

class XOffscreen : public OffscreenWindow {
 public:
  XOffscreen(int width, int height) : window_(vtkSmartPointer<vtkRenderWindow>::New()) {
    window_->SetOffScreenRendering(1);
    window_->SetSize(width, height);
  }
  vtkRenderWindow* window() override { return window_; }
  std::string name() const override { return "X"; }

 private:
  vtkSmartPointer<vtkRenderWindow> window_;
};

}  // namespace

class MessageWindow : public vtkOutputWindow {
 public:
  static MessageWindow* New();
  void DisplayText(const char* text) override {
    if (this->GetCurrentMessageType() != MESSAGE_TYPE_ERROR) return;
    const std::lock_guard<std::mutex> lock(mutex);
    if (first_error.empty() && text != nullptr) first_error = text;
  }
  std::mutex mutex;  // VTK's worker threads report too
  std::string first_error;
};
vtkStandardNewMacro(MessageWindow);

std::unique_ptr<OffscreenWindow> OffscreenWindow::create(int width, int height) {
  auto egl = std::make_unique<EglOffscreen>();
  if (egl->open(width, height)) return egl;
  const std::string problem = xServerProblem();
  if (problem.empty()) return std::make_unique<XOffscreen>(width, height);
  throw RenderError("nothing here can draw: no EGL driver, and " + problem +
                    "; install libegl1 and libgl1-mesa-dri (no display is needed)");
}

CapturedMessages::CapturedMessages()
    : before_(vtkOutputWindow::GetInstance()), messages_(vtkSmartPointer<MessageWindow>::New()) {
  vtkOutputWindow::SetInstance(messages_);
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);  // it prints beside the output window
}

CapturedMessages::~CapturedMessages() {
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_INFO);  // VTK's default; it has no getter
  vtkOutputWindow::SetInstance(before_);
}

std::string CapturedMessages::firstError() const {
  const std::lock_guard<std::mutex> lock(messages_->mutex);
  std::string text = messages_->first_error;
  for (char& c : text) {
    if (c == '\n') c = ' ';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

Image imageOf(vtkRenderWindow* window) {
  const int* size = window->GetSize();
  Image image{size[0], size[1], 3, {}};
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetPixelData(0, 0, image.width - 1, image.height - 1, 0, pixels);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(image.width);
  image.pixels.resize(row_bytes * static_cast<std::size_t>(image.height));
  if (static_cast<std::size_t>(pixels->GetNumberOfValues()) < image.pixels.size()) return image;
  for (int row = 0; row < image.height; ++row) {
    const unsigned char* from =
        pixels->GetPointer(static_cast<vtkIdType>(row_bytes) * (image.height - 1 - row));
    std::copy(from, from + row_bytes,
              image.pixels.data() + row_bytes * static_cast<std::size_t>(row));
  }
  return image;
}

Image renderOffscreen(int width, int height, const std::vector<vtkRenderer*>& renderers) {
  const CapturedMessages messages;
  const auto screen = OffscreenWindow::create(width, height);
  vtkRenderWindow* window = screen->window();
  window->SetMultiSamples(kSamplesPerPixel);
  for (vtkRenderer* renderer : renderers) window->AddRenderer(renderer);
  window->Render();
  if (const std::string error = messages.firstError(); !error.empty())
    throw RenderError("drawing failed (" + screen->name() + "): " + error);
  Image image = imageOf(window);
  for (vtkRenderer* renderer : renderers) window->RemoveRenderer(renderer);
  return image;
}

void requireDrawn(const Image& image) {
  if (isBlank(image))
    throw RenderError(
        "the picture came out blank: nothing is in view, or the graphics driver failed; try "
        "another camera, or install libgl1-mesa-dri");
}

}  // namespace planar_mapping::visualization
