/* Search where there is no server. Browsers refuse to start a worker for a page that was opened from
 * a file, so the worker's script runs in a hidden frame that hands messages on as a worker does. The
 * theme's search looks for `IFrameWorker` by that name to know where its own files are.
 */
class IFrameWorker extends EventTarget {
  constructor(url) {
    super();
    this.frame = document.createElement("iframe");
    this.frame.hidden = true;
    document.body.appendChild(this.frame);
    this.inside = this.frame.contentWindow;
    this.waiting = [];
    const page = this.inside.document;
    page.open();
    page.write("<!doctype html><title>Search</title>");
    page.close();
    this.inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
    const script = page.createElement("script");
    script.src = url;
    script.onload = () => {
      const early = this.waiting;
      this.waiting = null;
      early.forEach((data) => this.postMessage(data));
    };
    page.head.appendChild(script);
  }

  postMessage(data) {
    if (this.waiting) this.waiting.push(data);
    else this.inside.dispatchEvent(new this.inside.MessageEvent("message", { data }));
  }

  terminate() {
    this.frame.remove();
  }
}
if (location.protocol === "file:") {
  window.IFrameWorker = IFrameWorker;
  window.Worker = IFrameWorker;
}
