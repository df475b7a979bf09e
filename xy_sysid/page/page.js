// STOP goes by a plain request, so that it works even when the page's own connection is broken; it is sent although the page is being loaded
// again meanwhile (keepalive).
window.xyStop = async () => {
  const gone = document.getElementById("gone");
  try {
    const answer = await fetch("/stop", { method: "POST", keepalive: true, headers: { "X-Requested-With": "xy_sysid" } });
    if (!answer.ok) throw new Error(String(answer.status));
    const said = await answer.json();
    gone.textContent = said.asked && !said.stopped ? "STOP: " + said.words : "";
    gone.classList.toggle("shown", Boolean(gone.textContent));
  } catch (error) {
    gone.textContent = "STOP did not reach the server (" + error.message + "). Use the emergency stop of the machine.";
    gone.classList.add("shown");
  }
};
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && document.getElementById("stop")) window.xyStop();
}, true);
