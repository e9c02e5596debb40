import "./icons.css";

/** Icons drawn on a grid of 16. They are decoration: whatever carries one also carries words. */

function Icon({ path, fill = false }: { path: string; fill?: boolean }) {
  return (
    <svg class={fill ? "icon icon-fill" : "icon"} viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
      <path d={path} />
    </svg>
  );
}

export const PlayIcon = () => <Icon fill path="M4.500 2.800v10.400a.6.6 0 0 0 .92.5l8-5.200a.6.6 0 0 0 0-1l-8-5.200a.6.6 0 0 0-.92.500z" />;
export const PauseIcon = () => <Icon fill path="M4 2.500h2.600v11H4zM9.400 2.500H12v11H9.400z" />;
export const HoldIcon = () => <Icon path="M8 1.500v13M2.400 4.750l11.200 6.500M13.600 4.750l-11.200 6.500" />;
export const PulseIcon = () => (
  <Icon path="M1 12.500h3.200c1 0 1.200-9.500 2.300-9.500s1.300 9.500 2.300 9.500h.8c.8 0 1-4.500 1.700-4.500s.9 4.500 1.700 4.500h2" />
);
export const SingleIcon = () => <Icon path="M8 4.500a3.500 3.500 0 1 0 0 7 3.500 3.500 0 0 0 0-7zM8 1v2M8 13v2M1 8h2M13 8h2" />;
export const ShareIcon = () => <Icon path="M8 10V1.500M5 4.500l3-3 3 3M4 7H2.500v7.500h11V7H12" />;
export const ControlIcon = () => (
  <Icon path="M8 1.600a6.400 6.400 0 1 0 0 12.800 6.400 6.400 0 0 0 0-12.800zM8 6.300a1.700 1.700 0 1 0 0 3.400 1.700 1.700 0 0 0 0-3.400zM8 9.700v4.600M1.800 7l4.500.6M14.200 7l-4.500.6" />
);
export const StepIcon = ({ back = false }: { back?: boolean }) => (
  <Icon path={back ? "M10.500 3.500 6 8l4.500 4.500M4 3.500v9" : "M5.500 3.500 10 8l-4.500 4.500M12 3.500v9"} />
);
