// SPDX-License-Identifier: MIT
#include "clients/websocket/winhttp/winhttp_link.h"

#include <utility>

#include <boost/asio/post.hpp>

#include "clients/websocket/winhttp/windows_text.h"

namespace clothstream {

using Stage = WebSocketEnd::Stage;

WinHttpLink::WinHttpLink(boost::asio::io_context& io, std::shared_ptr<const CertificateCheck> check,
                         WinHttpListener& listener)
    : check_(std::move(check)), listener_(&listener), io_(&io) {}

DWORD_PTR WinHttpLink::newContext() {
  return reinterpret_cast<DWORD_PTR>(new std::shared_ptr<WinHttpLink>(shared_from_this()));
}

void WinHttpLink::freeContext(DWORD_PTR context) {
  delete reinterpret_cast<std::shared_ptr<WinHttpLink>*>(context);
}

void WinHttpLink::detach() {
  listener_ = nullptr;
  const std::lock_guard lock(mutex_);
  io_ = nullptr;
}

void CALLBACK WinHttpLink::called(HINTERNET handle, DWORD_PTR context, DWORD status, void* about,
                                  DWORD bytes) noexcept {
  if (context == 0) return;  // a handle that has no link
  if (status == WINHTTP_CALLBACK_STATUS_HANDLE_CLOSING) return freeContext(context);
  (*reinterpret_cast<std::shared_ptr<WinHttpLink>*>(context))->notified(handle, status, about, bytes);
}

void WinHttpLink::notified(HINTERNET handle, DWORD status, const void* about, DWORD bytes) {
  using Kind = WinHttpEvent::Kind;
  WinHttpEvent event;
  switch (status) {
    case WINHTTP_CALLBACK_STATUS_RESOLVING_NAME:
      stage = Stage::lookup;
      return;
    case WINHTTP_CALLBACK_STATUS_CONNECTING_TO_SERVER:
      stage = Stage::connect;
      return;
    case WINHTTP_CALLBACK_STATUS_CONNECTED_TO_SERVER:
      stage = check_ ? Stage::tls : Stage::upgrade;
      return;
    case WINHTTP_CALLBACK_STATUS_SENDING_REQUEST:
      stage = Stage::upgrade;
      return;
    case WINHTTP_CALLBACK_STATUS_SENDREQUEST_COMPLETE:
      event.kind = Kind::sent;
      if (check_) event.certificate = checkCertificate(handle);
      break;
    case WINHTTP_CALLBACK_STATUS_HEADERS_AVAILABLE:
      event.kind = Kind::answered;
      break;
    case WINHTTP_CALLBACK_STATUS_READ_COMPLETE:
      event.kind = Kind::read;
      event.bytes = bytes;
      if (stage == Stage::open) {
        const auto& read = *static_cast<const WINHTTP_WEB_SOCKET_STATUS*>(about);
        event.bytes = read.dwBytesTransferred;
        event.type = read.eBufferType;
      }
      break;
    case WINHTTP_CALLBACK_STATUS_WRITE_COMPLETE:
      event.kind = Kind::written;
      break;
    case WINHTTP_CALLBACK_STATUS_SHUTDOWN_COMPLETE:
      event.kind = Kind::saidGoodbye;
      break;
    case WINHTTP_CALLBACK_STATUS_REQUEST_ERROR:
      // An error of a WebSocket begins with the same members.
      event.error = static_cast<const WINHTTP_ASYNC_RESULT*>(about)->dwError;
      if (stage == Stage::open && static_cast<const WINHTTP_WEB_SOCKET_ASYNC_RESULT*>(about)->Operation ==
                                      WINHTTP_WEB_SOCKET_SEND_OPERATION)
        event.kind = Kind::writeFailed;
      break;
    default:
      return;
  }
  post(std::move(event));
}

CertificateCheck::Result WinHttpLink::checkCertificate(HINTERNET request) const {
  PCCERT_CONTEXT certificate = nullptr;
  DWORD bytes = sizeof certificate;
  if (!WinHttpQueryOption(request, WINHTTP_OPTION_SERVER_CERT_CONTEXT, &certificate, &bytes) || !certificate)
    return {.trusted = false, .shownKey = {}, .why = windowsErrorText(GetLastError())};
  const std::unique_ptr<const CERT_CONTEXT, void (*)(PCCERT_CONTEXT)> owner(
      certificate, [](PCCERT_CONTEXT freed) { CertFreeCertificateContext(freed); });
  return check_->check(*certificate);
}

void WinHttpLink::post(WinHttpEvent event) {
  const std::lock_guard lock(mutex_);
  if (io_ == nullptr) return;
  boost::asio::post(*io_, [self = shared_from_this(), event = std::move(event)] {
    if (self->listener_ != nullptr) self->listener_->happened(event);
  });
}

}  // namespace clothstream
