#!/usr/bin/env python3
"""Opens a report in a real browser and uses it: browser.py REPORT.html [SCREENSHOT.png]

Needs chromium and chromedriver (Debian: chromium-driver), drives them by the WebDriver protocol and
nothing but the standard library. Exit codes: 0 good, 1 a check failed, 77 there is no browser.
"""
import base64
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request


class Browser:
    def __init__(self, driver, chromium, profile, size):
        self.process = subprocess.Popen([driver, "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        port = None
        for line in self.process.stdout:
            if "successfully on port" in line:
                port = line.split("on port")[1].strip(" .\n")
                break
        if port is None:
            raise RuntimeError("chromedriver did not start")
        self.root = f"http://127.0.0.1:{port}/session"
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                     f"--user-data-dir={profile}", f"--window-size={size}"]
        options = {"binary": chromium, "args": arguments}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        made = self.call("POST", "", {"capabilities": {"alwaysMatch": wanted}})
        self.root += "/" + made["sessionId"]

    def call(self, verb, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.root + path, data, {"Content-Type": "application/json"}, method=verb)
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def script(self, text, *arguments):
        return self.call("POST", "/execute/sync", {"script": text, "args": list(arguments)})

    def mouse(self, x, y, click=False):
        steps = [{"type": "pointerMove", "x": int(x) - 3, "y": int(y)}, {"type": "pointerMove", "x": int(x), "y": int(y)}]
        if click:
            steps += [{"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]
        self.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": steps}]})

    def close(self):
        try:
            self.call("DELETE", "")
        finally:
            self.process.terminate()
            self.process.wait()


def wait_for(what, test, seconds=20):
    end = time.time() + seconds
    while time.time() < end:
        value = test()
        if value:
            return value
        time.sleep(0.1)
    raise AssertionError("waited in vain for " + what)


def check(browser, url):
    browser.call("POST", "/url", {"url": url})
    wait_for("the page's script", lambda: browser.script("return document.documentElement.dataset.ready === 'yes'"))

    plots = browser.script("return [...document.querySelectorAll('.plot')].map(p => [p.id, "
                           "p.querySelectorAll('.scatterlayer .trace').length, p.data.length])")
    assert plots, "the page has no plots"
    for name, drawn, given in plots:
        assert drawn > 1 and given > 1, f"{name} has {drawn} curves of {given}"
    name = plots[0][0]
    print(f"{len(plots)} plots, {plots[0][1]} curves in {name}")

    browser.script("document.getElementById(arguments[0]).scrollIntoView({block: 'center'})", name)
    time.sleep(0.3)
    # The last point of the last curve: hovering over it must tell what it is.
    place = browser.script(
        "const points = document.getElementById(arguments[0]).querySelectorAll('.scatterlayer .trace:last-child .point');"
        "const box = points[points.length - 1].getBoundingClientRect();"
        "return [box.left + box.width / 2, box.top + box.height / 2]", name)
    browser.mouse(*place)
    told = wait_for("the hover text", lambda: browser.script(
        "const t = document.querySelector('#' + arguments[0] + ' .hoverlayer .hovertext'); return t && t.textContent", name))
    for words in ("dt = ", "error ", "s per simulated second"):
        assert words in told, f"the hover text lacks \"{words}\": {told}"
    print("hover: " + told)

    # A click on a method in the legend hides its curves.
    visible = ("return document.getElementById(arguments[0])._fullData.filter(t => t.visible === true && "
               "t.legendgroup).map(t => t.legendgroup)")
    before = browser.script(visible, name)
    method, x, y = browser.script(
        "const items = [...document.querySelectorAll('#' + arguments[0] + ' .legend .traces')];"
        "const item = items[items.length - 1]; const box = item.querySelector('.legendtoggle').getBoundingClientRect();"
        "return [item.querySelector('.legendtext').textContent, box.left + 20, box.top + box.height / 2]", name)
    assert method in before, f"{method} is not shown at first: {before}"
    browser.mouse(x, y, click=True)
    wait_for("the legend to hide " + method, lambda: method not in browser.script(visible, name), 5)
    print("legend: hid " + method)
    browser.mouse(x, y, click=True)
    wait_for("the legend to show " + method, lambda: method in browser.script(visible, name), 5)

    # A precision can be switched off.
    box = browser.script("const box = document.querySelector('#' + arguments[0].replace('plot', 'tools') + ' input');"
                         "box.click(); return box.value", name)
    shown = browser.script("return document.getElementById(arguments[0])._fullData.filter(t => t.meta === arguments[1])"
                           ".map(t => t.visible !== false && t.opacity !== 0)", name, box)
    assert shown and not any(shown), f"{box} is still shown"
    print("precision: hid " + box)

    severe = [line["message"] for line in browser.call("POST", "/se/log", {"type": "browser"}) if line["level"] == "SEVERE"]
    assert not severe, "errors in the console: " + "; ".join(severe)


def main():
    page = pathlib.Path(sys.argv[1]).resolve()
    driver = shutil.which("chromedriver")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not driver or not chromium:
        print("skipped: there is no chromium or no chromedriver (apt-get install chromium-driver)")
        return 77
    os.environ.setdefault("HOME", tempfile.gettempdir())
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(driver, chromium, profile, os.environ.get("WINDOW", "1360,1500"))
        try:
            check(browser, page.as_uri())
            if len(sys.argv) > 2:
                browser.script("document.querySelector('.tools input').click()")
                browser.script("document.querySelector(arguments[0]).scrollIntoView()", os.environ.get("SHOW", "section"))
                time.sleep(1)
                pathlib.Path(sys.argv[2]).write_bytes(base64.b64decode(browser.call("GET", "/screenshot")))
        except AssertionError as failure:
            print(f"failed: {failure}")
            return 1
        finally:
            browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
